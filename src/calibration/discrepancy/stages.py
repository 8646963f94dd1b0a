"""The stages of the diagnosis: each reads its input files and writes its output files."""

import json
from pathlib import Path

from calibration import figures as common
from calibration.discrepancy import figures
from calibration.discrepancy.catalogue import load_catalogue
from calibration.discrepancy.design import plan
from calibration.discrepancy.emulator import teach
from calibration.discrepancy.extend import extension_plan, gain, real_values
from calibration.discrepancy.identify import BASE, identify
from calibration.discrepancy.measurements import read_measurements
from calibration.discrepancy.model import Emulated
from calibration.discrepancy.runs import simulate
from calibration.discrepancy.settings import check_range, parameters_of
from calibration.discrepancy.verdict import extended_name, findings, page, validate
from dem.io.files import write_json


def load(config, settings):
    """Measurements, checked against the emulators' range, and the experiments that they need."""
    measurements = read_measurements(config.measurements)
    check_range(settings, measurements, config.measurements)
    return measurements, list(dict.fromkeys(m.experiment for m in measurements))


def plan_runs(config, settings, output):
    """Write the emulators' design and plan."""
    _, kinds = load(config, settings)
    factors = parameters_of(settings, config.factors, kinds)
    rows, specs = plan(settings, config.run, factors, load_catalogue(), kinds)
    write_json(output.design, rows)
    write_json(output.plan, specs)


def run_batch(plan_file, batch, batches, done):
    """Run every `batches`-th run of a plan; the results stand under results/runs."""
    specs = json.loads(Path(plan_file).read_text())
    own = dict(sorted(specs.items())[batch::batches])
    metrics = simulate(own, note=lambda text: print(text, flush=True))
    write_json(done, {"runs": len(own), "failed": [k for k, v in metrics.items() if v is None]})


def _emulated(config, settings, kinds, design, specs):
    factors = parameters_of(settings, config.factors, kinds)
    metrics = simulate(specs)  # all there: the batches ran them
    emulators, table = teach(design, metrics, settings, factors)
    return Emulated(emulators, settings, factors, load_catalogue()), table


def diagnose(config, settings, source, output):
    """Calibrate, show the misfit, name the cause, and plan the runs that measure the gain."""
    measurements, kinds = load(config, settings)
    design, specs = (json.loads(Path(f).read_text()) for f in (source.design, source.plan))
    emulated, errors = _emulated(config, settings, kinds, design, specs)
    found = identify(emulated, measurements, settings.alpha, settings.replicates, settings.seed)
    verdict = findings(emulated, measurements, found) | {"emulators": errors}
    name = extended_name(found)
    models = {"before": found.models[BASE], "after": found.models[name]} if name else {}
    rows, specs = extension_plan(settings, config.run, models, measurements)
    mechanisms = [m.name for m in models["after"].mechanisms] if name else []
    write_json(output.findings, verdict)
    write_json(output.extension, {"mechanisms": mechanisms, "rows": rows})
    write_json(output.plan, specs)
    common.save(figures.residual_figure(verdict["residuals"]), output.residuals)
    common.save(figures.ranking_figure(verdict), output.ranking)


def conclude(config, settings, source, output):
    """Measure the gain with the finished runs and write verdict.json and its page."""
    measurements, kinds = load(config, settings)
    verdict = json.loads(Path(source.findings).read_text())
    extension = json.loads(Path(source.extension).read_text())
    if extension["rows"]:
        metrics = simulate(json.loads(Path(source.plan).read_text()))
        factors = parameters_of(settings, config.factors, kinds)
        values = {}
        for label, names in (("before", []), ("after", extension["mechanisms"])):
            # no prediction is asked of these models: they only carry parameters and laws
            model = _Carrier(factors, [load_catalogue()[n] for n in names])
            rows = [r for r in extension["rows"] if r["label"] == label]
            values[label] = real_values(settings, model, measurements, rows, metrics)
        verdict["gain"] = gain(measurements, values["before"], values["after"])
    validate(verdict)
    write_json(output.verdict, verdict)
    Path(output.page).write_text(page(verdict))


class _Carrier:
    """Factors and mechanisms in the order of a model's parameters."""

    def __init__(self, factors, mechanisms):
        self.factors, self.mechanisms = factors, mechanisms
