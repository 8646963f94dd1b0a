"""The stages of the diagnosis: each reads its input files and writes its output files."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from calibration import figures as common
from calibration.files import read_json, write_table, write_text
from calibration.runs.simulated import simulate
from calibration.telling.report.plain import write_page
from dem.io.files import write_json
from diagnosis import (
    better_plan,
    contacts,
    emulator_waves,
    exclusion,
    figures,
    held_out,
    power,
    power_emulated,
    remarks,
    time_step,
)
from diagnosis.derived import WRITTEN, announced, as_file, seconds_of_kinds
from diagnosis.design import plan, trained
from diagnosis.extend import LEAST_RUNS, extension_plan, gain, real_values, refit_of, within
from diagnosis.failures import as_tests
from diagnosis.identify import identify, lack_of_fit, weigh
from diagnosis.page.first_lines import first_lines
from diagnosis.page.markdown import page
from diagnosis.residuals import by_chance, calibration, residual_rows, trends
from diagnosis.rules import after_runs, after_scores
from diagnosis.settings import BASE, study_settings, with_gain_runs
from diagnosis.setup import Setup
from diagnosis.verdict import extended_name, findings, unexplained, validate

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles


def plan_power(setup: Setup, source: NamedFiles, output: NamedFiles) -> None:
    """How strong a law must be for the study's table, its values guesses, to show it."""
    if not setup.of_contacts:
        emulated, _ = setup.emulated(source.designs, source.plans)
        rows = power_emulated.power(emulated, setup.measurements, setup.settings.alpha)
        _write_power(output, {"plan": rows, "better": [], "better_settings": []}, "")
        return
    rows, plan, better = better_plan.best(
        setup.measurements,
        lambda own: contacts.power_of(own, setup.rig, setup.catalogue),
        contacts.defaults_of(setup.settings, setup.kinds),
    )
    settings = [{"experiment": m.experiment, "levers": m.levers} for m in plan]
    more = "\n" + (better_plan.page(plan) if plan else better_plan.NONE)
    _write_power(output, {"plan": rows, "better": better, "better_settings": settings}, more)


def _write_power(output, found, more):
    write_json(output.power, found)
    write_text(power.page(found["plan"], found["better"]) + more, output.page)


def plan_runs(setup: Setup, output: NamedFiles) -> None:
    """Check the measurements; write the emulators' design and plan."""
    rows, specs = plan(setup.rig, setup.catalogue, setup.emulated_kinds)
    write_json(output.design, rows)
    write_json(output.plan, specs)
    written = Path(output.design).with_name(WRITTEN)
    write_text(as_file(setup.settings, setup.config), written)
    if specs:
        print(announced(setup.settings, specs, written), file=sys.__stderr__)


def plan_refinement(setup: Setup, source: NamedFiles, output: NamedFiles, wave: int) -> None:
    """Plan the runs of a wave, where emulators are too rough at the posterior mode."""
    rows, specs, found = [], {}, []  # type: ignore[var-annotated]
    if not setup.of_contacts:
        emulated, _ = setup.emulated(source.designs, source.plans)
        first = trained(setup.rig, setup.catalogue, setup.emulated_kinds)
        rows, specs, found = emulator_waves.plan_wave(
            emulated, setup.tested, setup.rig, wave, first
        )
    write_json(output.design, rows)
    write_json(output.plan, specs)
    write_json(output.left, {"wave": wave, "runs": len(specs), "left": found})


def calibrate(setup: Setup, source: NamedFiles, output: NamedFiles) -> None:
    """Calibrate the base model on all measurements at once and show where it fails."""
    if setup.of_contacts:
        found = contacts.base(setup.measurements, setup.settings, setup.factors)
        _write_calibration(found, output)
        return
    settings = setup.settings
    emulated, _ = setup.emulated(source.designs, source.plans)
    scores = weigh(emulated, setup.tested, settings.replicates, settings.seed, ())
    model, fitted = scores.models[BASE], scores.fits[BASE]
    error = scores.data.error[0]
    drawn = by_chance(scores.measurements, error, fitted.sd[0])
    rows = residual_rows(scores.measurements, fitted, drawn, error)
    summary = {
        "calibration": calibration(model, fitted),
        "lack_of_fit": lack_of_fit(fitted, scores.lack_p),
        "patterns": trends(rows, drawn),
    }
    _write_calibration(summary | {"residuals": rows}, output)


def _write_calibration(summary, output):
    rows = summary.pop("residuals")
    write_json(output.summary, summary)
    table = pd.DataFrame([r | r["levers"] for r in rows]).drop(columns="levers")
    write_table(table, output.table)
    common.save(figures.residual_figure(rows), output.residuals)


def name_causes(setup: Setup, source: NamedFiles, output: NamedFiles) -> None:
    """Name the cause, and plan the runs that measure the gain."""
    if setup.of_contacts:
        _diagnose_contacts(setup, output)
        return
    settings, measurements, table = setup.settings, setup.measurements, setup.table
    emulated, errors = setup.emulated(source.designs, source.plans)
    found = identify(emulated, setup.tested, settings.alpha, settings.replicates, settings.seed)
    name = extended_name(found)
    verdict = findings(emulated, measurements, found) | {"emulators": errors}
    verdict["refinement"] = {
        "share": emulator_waves.SHARE,
        "waves": [read_json(file) for file in source.left],
        "left": emulator_waves.left(emulated, setup.tested),
        "run_seconds": seconds_of_kinds(setup.rig, setup.tested),
    }
    verdict["outcomes"] = remarks.of_outcomes(found, name)
    verdict = after_scores(
        verdict, found, measurements, setup.lever_laws, errors, emulated.catalogue
    )
    verdict["exclusion"] = exclusion.of_mechanisms(found)
    shown = {"before": ((), found.fits[BASE])}
    shown |= {"after": (tuple(name.split(" + ")), found.fits[name])} if name else {}  # type: ignore[dict-item]
    verdict["held_out"] = held_out.by_emulators(
        emulated, measurements, table.held_out, shown, found.data
    )
    verdict["remarks"] = remarks.remarks(table, {r["experiment"] for r in verdict["outcomes"]})
    verdict["remarks"] += remarks.untrained(errors)
    models = {"before": found.models[BASE], "after": found.models[name]} if name else {}
    budget = settings.runs - trained(setup.rig, setup.catalogue, setup.emulated_kinds)  # type: ignore[operator]  # `derived` fills it in
    budget -= sum(wave["runs"] for wave in verdict["refinement"]["waves"])
    budget -= 2 * LEAST_RUNS * len(setup.kinds)  # the check of the time step
    each, places = within(budget, len(models), measurements, settings.gain_runs)
    rig = replace(setup.rig, settings=with_gain_runs(settings, each))
    rows, specs = extension_plan(rig, models, measurements, found.data, places=places)
    base_fit = found.fits[BASE].theta[0]
    rig = replace(rig, settings=with_gain_runs(settings, LEAST_RUNS))
    steps, more = time_step.plan(rig, found.models[BASE], base_fit, measurements)
    mechanisms = [m.name for m in models["after"].mechanisms] if name else []
    write_json(output.findings, verdict)
    write_json(output.extension, {"mechanisms": mechanisms, "rows": rows, "steps": steps})
    write_json(output.plan, specs | more)
    extended = found.fits[name].expected[0] if name else None
    common.save(
        figures.prediction_figure(verdict["residuals"], extended, name or ""), output.predictions
    )
    common.save(figures.ranking_figure(verdict), output.ranking)


def _diagnose_contacts(setup, output):
    """The same of single contacts, which the engine integrates at once: no runs are left."""
    settings, measurements, table = setup.settings, setup.measurements, setup.table
    found = contacts.discovered(measurements, setup.rig, setup.catalogue)
    verdict = contacts.findings(measurements, found, settings, setup.factors)
    verdict = contacts.with_engine(
        verdict, measurements, found, setup.rig, setup.catalogue, table.held_out
    )
    if verdict["verdict"] == "unexplained":
        verdict |= unexplained(verdict["residuals"])
    verdict["time_step"] = contacts.half_step(measurements, setup.rig)
    defaults = contacts.defaults_of(settings, setup.kinds)
    verdict["held_out"] = held_out.by_contacts(measurements, table.held_out, found, defaults)
    verdict["remarks"] = remarks.remarks(table)
    write_json(output.findings, verdict)
    named = verdict["causes"] if verdict["verdict"] == "identified" else []
    write_json(output.extension, {"mechanisms": named, "rows": [], "steps": []})
    write_json(output.plan, {})
    after = contacts.with_law(measurements, found)
    common.save(
        figures.prediction_figure(verdict["residuals"], after, "the law"), output.predictions
    )
    common.save(figures.ranking_figure(verdict), output.ranking)


def conclude(setup: Setup, source: NamedFiles, output: NamedFiles) -> None:
    """Measure the gain with the finished runs and write verdict.json, its page and figure."""
    settings, measurements = setup.settings, setup.measurements
    verdict, extension = read_json(source.findings), read_json(source.extension)
    specs = read_json(source.plan)
    metrics = as_tests(settings, specs, simulate(specs))
    if extension["steps"]:
        verdict["time_step"] = time_step.check(settings, measurements, extension["steps"], metrics)
    rows = extension["rows"]
    if rows:
        values = real_values(settings, setup.catalogue, measurements, rows, metrics)
        # a law of single contacts is run in its own experiment alone
        own = sorted({r["setting"] for r in rows})
        pair = (values[label][own] for label in ("before", "after"))
        sds = (
            {}
            if setup.of_contacts
            else {(s["experiment"], s["of"]): s["sd"] for s in verdict["scatter"]}
        )
        refit = refit_of(rows, "after", len(measurements))[own]
        verdict["gain"] = gain([measurements[i] for i in own], *pair, shared=sds, refit=refit)  # type: ignore[arg-type, misc]
        verdict["extended_with"] = extension["mechanisms"]
    verdict = verdict if setup.of_contacts else after_runs(verdict)
    if verdict["verdict"] == "unexplained" and "discrepancy" not in verdict:
        verdict |= unexplained(verdict["residuals"])
    verdict["first_lines"] = first_lines(verdict)
    validate(verdict)
    common.save(figures.gain_figure(verdict["gain"]), output.gain)
    write_json(output.verdict, verdict)
    text = page(verdict)
    write_text(text, output.page)
    write_page("Diagnosis", text, Path(output.page).parent, output.alone)


def _of_study(stage):
    """A stage as the workflow calls it: `stage(study, source, output)`."""
    return lambda study, *files: stage(Setup(study, study_settings(study.config)), *files)


def _wave(setup, source, output):
    """See `plan_refinement`; the wave's folder bears its number."""
    wave = int(Path(output.plan).parent.name.removeprefix("wave_"))
    plan_refinement(setup, source, output, wave)


diagnosis_power = _of_study(plan_power)
diagnosis_plan = _of_study(lambda setup, source, output: plan_runs(setup, output))
diagnosis_wave = _of_study(_wave)
diagnosis_calibrate = _of_study(calibrate)
diagnosis_identify = _of_study(name_causes)
diagnose = _of_study(conclude)
