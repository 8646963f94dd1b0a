"""The stages of the diagnosis: each reads its input files and writes its output files."""

import json
from pathlib import Path

import pandas as pd
from scipy import stats

from calibration import figures as common
from calibration.batches import simulate
from calibration.errors import ConfigError
from calibration.factors import read_factors
from calibration.files import replacing, write_table
from dem.io.files import write_json
from diagnosis import aside, contacts, exclusion, figures, power, time_step
from diagnosis.design import plan
from diagnosis.emulator import train
from diagnosis.emulator_files import read_emulators, write_emulators
from diagnosis.extend import extension_plan, gain, real_values
from diagnosis.fit import data_of, fit
from diagnosis.identify import identify
from diagnosis.measurements import read_all
from diagnosis.model import Emulated
from diagnosis.residuals import calibration, residual_rows, trends
from diagnosis.settings import (
    BASE,
    catalogue_of,
    check_range,
    check_specs,
    parameters_of,
    read_settings,
)
from diagnosis.verdict import extended_name, findings, page, validate


def read(config):
    """All rows of the study's table of measurements."""
    return read_all(config.measurements)


def load(config, settings):
    """Measurements, checked against the emulators' range, and the experiments that they need."""
    table = read(config)
    measurements = table.fitted
    if not contacts.alone(m.experiment for m in measurements):
        check_range(settings, measurements + table.held_out, config.measurements)
    check_specs(settings, base_of(config), measurements + table.held_out)
    return measurements, list(dict.fromkeys(m.experiment for m in measurements))


def base_of(config):
    """The calibration's run spec (a mapping) with the experiment that it was calibrated on."""
    return config.run | {"experiment": config.experiment}


def plan_power(config, settings, output):
    """How strong a law must be for the study's table, its values guesses, to show it."""
    table = read(config).fitted
    kinds = list(dict.fromkeys(m.experiment for m in table))
    if not contacts.alone(kinds):
        raise ConfigError(
            "has experiments whose power is not computed",
            path=config.measurements,
            value=", ".join(k for k in kinds if k not in contacts.CONTACTS),
            allowed=f"rows of {' and '.join(contacts.CONTACTS)}",
        )
    known = catalogue_of(settings, kinds)
    rows = contacts.power_of(table, settings, base_of(config), known)
    write_json(output.power, rows)
    with replacing(output.page) as partial:
        partial.write_text(power.page(rows))


def plan_runs(config, settings, output):
    """Check the measurements; write the emulators' design and plan."""
    _, kinds = load(config, settings)
    # single contacts are integrated, not emulated
    kinds = [] if contacts.alone(kinds) else kinds
    factors = parameters_of(settings, config.factors, kinds)
    rows, specs = plan(settings, base_of(config), factors, catalogue_of(settings, kinds), kinds)
    write_json(output.design, rows)
    write_json(output.plan, specs)


def emulate(config, settings, source, output):
    """Train the emulators with the finished runs; the errors that they own to stand beside them."""
    _, kinds = load(config, settings)
    train_all(settings, parameters_of(settings, config.factors, kinds), source, output)


def train_all(settings, factors, source, output):
    """Write the emulators that a design's finished runs train, and the table of their errors."""
    design, specs = (json.loads(Path(f).read_text()) for f in (source.design, source.plan))
    emulators, table = train(design, simulate(specs), settings, factors)
    write_emulators(output.emulators, emulators)
    write_json(output.errors, table)


def _emulated(config, settings, kinds, emulators):
    factors = parameters_of(settings, config.factors, kinds)
    trained = read_emulators(emulators)
    return Emulated(trained, settings, factors, catalogue_of(settings, kinds))


def calibrate(config, settings, source, output):
    """Calibrate the base model on all measurements at once and show where it fails."""
    measurements, kinds = load(config, settings)
    if contacts.alone(kinds):
        _write_calibration(contacts.base(measurements, settings, _factors(config)), output)
        return
    emulated = _emulated(config, settings, kinds, source.emulators)
    model = emulated.model([(m.experiment, m.levers) for m in measurements])
    fitted = fit(model, data_of(measurements))
    rows = residual_rows(measurements, fitted)
    chi, freedom = float(fitted.chi_square[0]), float(fitted.freedom[0])
    summary = {
        "calibration": calibration(model, fitted),
        "lack_of_fit": {
            "chi_square": chi,
            "freedom": freedom,
            "p": float(stats.chi2.sf(chi, freedom)),
        },
        "patterns": trends(rows),
    }
    _write_calibration(summary | {"residuals": rows}, output)


def _factors(config):
    return read_factors(config.factors)


def _write_calibration(summary, output):
    rows = summary.pop("residuals")
    write_json(output.summary, summary)
    table = pd.DataFrame([r | r["levers"] for r in rows]).drop(columns="levers")
    write_table(table, output.table)
    common.save(figures.residual_figure(rows), output.residuals)


def name_causes(config, settings, source, output):
    """Name the cause, and plan the runs that measure the gain."""
    measurements, kinds = load(config, settings)
    if contacts.alone(kinds):
        _diagnose_contacts(config, settings, measurements, kinds, output)
        return
    emulated = _emulated(config, settings, kinds, source.emulators)
    found = identify(emulated, measurements, settings.alpha, settings.replicates, settings.seed)
    errors = json.loads(Path(source.errors).read_text())
    name = extended_name(found)
    verdict = findings(emulated, measurements, found) | {"emulators": errors}
    verdict["exclusion"] = exclusion.of_mechanisms(found, measurements)
    table = read(config)
    shown = {"before": ((), found.fits[BASE])}
    shown |= {"after": (tuple(name.split(" + ")), found.fits[name])} if name else {}
    verdict["held_out"] = aside.by_emulators(emulated, table.held_out, shown)
    verdict["remarks"] = aside.remarks(table)
    models = {"before": found.models[BASE], "after": found.models[name]} if name else {}
    rows, specs = extension_plan(settings, base_of(config), models, measurements)
    base_fit = found.fits[BASE].theta[0]
    steps, more = time_step.plan(
        settings, base_of(config), found.models[BASE], base_fit, measurements
    )
    mechanisms = [m.name for m in models["after"].mechanisms] if name else []
    write_json(output.findings, verdict)
    write_json(output.extension, {"mechanisms": mechanisms, "rows": rows, "steps": steps})
    write_json(output.plan, specs | more)
    extended = found.fits[name].predicted[0] if name else None
    common.save(
        figures.prediction_figure(verdict["residuals"], extended, name or ""), output.predictions
    )
    common.save(figures.ranking_figure(verdict), output.ranking)


def _diagnose_contacts(config, settings, measurements, kinds, output):
    """The same of single contacts: laws found on the measurements, no runs to make."""
    known = catalogue_of(settings, kinds)
    found = contacts.discovered(measurements, settings, base_of(config), known)
    verdict = contacts.findings(measurements, found, settings, _factors(config))
    verdict["exclusion"] = exclusion.of_contacts(found.trials, known)
    verdict["time_step"] = contacts.half_step(measurements, settings, base_of(config))
    table, defaults = read(config), contacts.defaults_of(settings, kinds)
    verdict["held_out"] = aside.by_contacts(
        measurements, table.held_out, found.trials, found.law, defaults
    )
    verdict["remarks"] = aside.remarks(table)
    write_json(output.findings, verdict)
    write_json(output.extension, {"mechanisms": [], "rows": [], "steps": []})
    write_json(output.plan, {})
    after = contacts.with_law(measurements, found)
    common.save(
        figures.prediction_figure(verdict["residuals"], after, "the law"), output.predictions
    )
    common.save(figures.ranking_figure(verdict), output.ranking)


def conclude(config, settings, source, output):
    """Measure the gain with the finished runs and write verdict.json, its page and figure."""
    measurements, kinds = load(config, settings)
    verdict = json.loads(Path(source.findings).read_text())
    extension = json.loads(Path(source.extension).read_text())
    metrics = simulate(json.loads(Path(source.plan).read_text()))
    if extension["steps"]:
        verdict["time_step"] = time_step.check(settings, measurements, extension["steps"], metrics)
    if extension["rows"]:
        factors = parameters_of(settings, config.factors, kinds)
        known, values = catalogue_of(settings, kinds), {}
        for label, names in (("before", []), ("after", extension["mechanisms"])):
            # no prediction is asked of these models: they only carry parameters and laws
            model = _Carrier(factors, [known[n] for n in names])
            rows = [r for r in extension["rows"] if r["label"] == label]
            values[label] = real_values(settings, model, measurements, rows, metrics)
        verdict["gain"] = gain(measurements, values["before"], values["after"])
        verdict["extended_with"] = extension["mechanisms"]
    validate(verdict)
    common.save(figures.gain_figure(verdict["gain"]), output.gain)
    write_json(output.verdict, verdict)
    with replacing(output.page) as partial:
        partial.write_text(page(verdict))


# as the workflow calls them


def _settings(study, source):
    return read_settings(source.settings, study.config.diagnosis)


def diagnosis_power(study, source, output):
    """See `plan_power`."""
    plan_power(study.config, _settings(study, source), output)


def diagnosis_plan(study, source, output):
    """See `plan_runs`."""
    plan_runs(study.config, _settings(study, source), output)


def diagnosis_emulate(study, source, output):
    """See `emulate`."""
    emulate(study.config, _settings(study, source), source, output)


def diagnosis_calibrate(study, source, output):
    """See `calibrate`."""
    calibrate(study.config, _settings(study, source), source, output)


def diagnosis_identify(study, source, output):
    """Name the cause, and plan the runs that measure the gain."""
    name_causes(study.config, _settings(study, source), source, output)


def diagnose(study, source, output):
    """Measure the gain with the finished runs, and write the verdict."""
    conclude(study.config, _settings(study, source), source, output)


class _Carrier:
    """Factors and mechanisms in the order of a model's parameters."""

    def __init__(self, factors, mechanisms):
        self.factors, self.mechanisms = factors, mechanisms
