"""The stages of the diagnosis: each reads its input files and writes its output files."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from calibration import figures as common
from calibration.chain.study import NamedFiles
from calibration.files import read_json, write_table, write_text
from calibration.runs.simulated import simulate
from calibration.telling.report.embed import write_page
from dem.io.files import write_json
from diagnosis import contacts, emulator_waves, extend, figures, held_out, power, verdict
from diagnosis.bulk import Bulk
from diagnosis.design import plan, trained
from diagnosis.emulator import as_tests
from diagnosis.extend import LEAST_RUNS, extension_plan, gain, real_values, within
from diagnosis.page.markdown import first_lines, page
from diagnosis.rules import OF_SIMULATED, by_runs, with_untried
from diagnosis.settings import study_settings
from diagnosis.setup import WRITTEN, Setup, announced, as_file, seconds_of_kinds


def plan_power(setup: Setup, source: NamedFiles, output: NamedFiles) -> None:
    """How strong a law must be for the study's table, its values guesses, to show it."""
    if not setup.of_contacts:
        emulated, _ = setup.emulated(source.designs, source.plans)
        rows = power.of_bulk(Bulk(emulated, setup.measurements), setup.settings.alpha)
    else:
        asked = contacts.asked(setup.measurements, setup.rig, setup.catalogue)
        rows = power.power(setup.measurements, catalogue=setup.catalogue, **asked)
    write_json(output.power, {"plan": rows})
    write_text(power.page(rows), output.page)


def plan_runs(setup: Setup, output: NamedFiles) -> None:
    """Check the measurements; write the emulators' design and plan."""
    kinds = [] if setup.of_contacts else setup.kinds
    rows, specs = plan(setup.rig, setup.catalogue, kinds)
    write_json(output.design, rows)
    write_json(output.plan, specs)
    written = Path(output.design).with_name(WRITTEN)
    write_text(as_file(setup.settings, setup.config), written)
    if specs:
        print(announced(setup.settings, specs, written), file=sys.__stderr__)


def plan_refinement(setup: Setup, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the runs of the next wave, where emulators are too rough at the posterior mode."""
    wave = len(source.designs)  # after the first plan
    emulated, _ = setup.emulated(source.designs, source.plans)
    first = trained(setup.rig, setup.catalogue, setup.kinds)
    bulk = Bulk(emulated, setup.tested)
    rows, specs, found = emulator_waves.plan_wave(bulk, setup.rig, wave, first)
    write_json(output.design, rows)
    write_json(output.plan, specs)
    write_json(output.left, {"wave": wave, "runs": len(specs), "left": found})


def name_causes(setup: Setup, source: NamedFiles, output: NamedFiles) -> None:
    """Show where the calibrated base model fails, name the cause, and plan the runs that measure
    the gain."""
    told, extension, specs, extended, name = (
        _of_contacts(setup) if setup.of_contacts else _of_simulated(setup, source)
    )
    write_json(output.findings, told)
    write_json(output.extension, extension)
    write_json(output.plan, specs)
    rows = told["residuals"]
    table = pd.DataFrame([r | r["levers"] for r in rows]).drop(columns="levers")
    write_table(table, output.table)
    common.save(figures.residual_figure(rows, extended, name), output.residuals)
    common.save(figures.ranking_figure(told), output.ranking)


def _of_simulated(setup, source):
    """What is told, what the runs to come are of, these, and what the extended model predicts, with
    its name."""
    settings, measurements, table = setup.settings, setup.measurements, setup.table
    emulated, errors = setup.emulated(source.designs, source.plans)
    bulk = Bulk(emulated, setup.tested, table.aside)
    found = bulk.judged(settings.alpha, settings.seed)
    names = verdict.extension(bulk, found)
    told = verdict.findings(bulk, found, names, settings.alpha) | {"emulators": errors}
    told["refinement"] = {
        "share": emulator_waves.SHARE,
        "waves": [read_json(file) for file in source.left],
        "left": emulator_waves.left(bulk),
        "run_seconds": seconds_of_kinds(setup.rig, setup.tested),
    }
    shown = {"before": ()} | ({"after": names} if names else {})
    told["outcomes"] = verdict.of_outcomes(bulk, shown)
    told = with_untried(told, errors, emulated.catalogue)
    told["held_out"] = held_out.by_emulators(bulk, table.held_out, found)
    told["remarks"] = verdict.remarks(table, {r["experiment"] for r in told["outcomes"]}, errors)
    models = {label: bulk.fit(own)[0] for label, own in shown.items()} if names else {}
    budget = settings.runs - trained(setup.rig, setup.catalogue, setup.kinds)  # type: ignore[operator]  # `setup` fills it in
    budget -= sum(wave["runs"] for wave in told["refinement"]["waves"])
    budget -= 2 * LEAST_RUNS * len(setup.kinds)  # the check of the time step
    each, places = within(budget, len(models), measurements, settings.gain_runs)
    rig = replace(setup.rig, settings=settings.model_copy(update={"gain_runs": each}))
    rows, specs = extension_plan(rig, models, measurements, bulk.data, places=places)
    rig = replace(rig, settings=settings.model_copy(update={"gain_runs": LEAST_RUNS}))
    steps, more = extend.time_step_plan(rig, bulk.base, bulk.fitted.theta[0], measurements)
    extended = bulk.fit(names)[1].expected[0] if names else None
    extension = {"mechanisms": list(names), "rows": rows, "steps": steps}
    extension["shared"] = [[*label, sd] for label, sd in bulk.shared.items()]
    return told, extension, specs | more, extended, " + ".join(names)


def _of_contacts(setup):
    """The same of single contacts, which the engine integrates at once: no runs are left."""
    settings, measurements, table = setup.settings, setup.measurements, setup.table
    found = contacts.discovered(measurements, setup.rig, setup.catalogue, table.aside)
    told = contacts.findings(measurements, found, settings, setup.factors)
    told = contacts.with_engine(told, measurements, found, setup.rig, setup.catalogue)
    defaults = contacts.defaults_of(settings, setup.kinds)
    told["held_out"] = held_out.by_contacts(measurements, table.held_out, found, defaults)
    told["remarks"] = verdict.remarks(table)
    named = told["causes"] if told["verdict"] == "identified" else []
    extension = {"mechanisms": named, "rows": [], "steps": []}
    return told, extension, {}, contacts.with_law(told["residuals"], found), "the law"


def conclude(setup: Setup, source: NamedFiles, output: NamedFiles) -> None:
    """Measure the gain with the finished runs and write verdict.json, its page and figure."""
    settings, measurements = setup.settings, setup.measurements
    told, extension = read_json(source.findings), read_json(source.extension)
    specs = read_json(source.plan)
    metrics = as_tests(settings, specs, simulate(specs))
    if extension["steps"]:
        told["time_step"] = extend.time_step_check(
            settings, measurements, extension["steps"], metrics
        )
    rows = extension["rows"]
    if rows:
        values = real_values(settings, setup.catalogue, measurements, rows, metrics)
        left = {r["setting"]: r["refit"] for r in rows if r["label"] == "after"}
        own = sorted(left)
        pair = (values[label][own] for label in ("before", "after"))
        shared = {(kind, label): sd for kind, label, sd in extension["shared"]}
        refit = np.array([left[i] for i in own])
        told["gain"] = gain([measurements[i] for i in own], *pair, shared=shared, refit=refit)  # type: ignore[arg-type, misc]
        told["extended_with"] = extension["mechanisms"]
    if not setup.of_contacts:
        told = by_runs(told, OF_SIMULATED)
    told["first_lines"] = first_lines(told)
    verdict.validate(told)
    common.save(figures.gain_figure(told["gain"]), output.gain)
    write_json(output.verdict, told)
    text = page(told)
    write_text(text, output.page)
    write_page("Diagnosis", text, Path(output.page).parent, output.alone)


def _of_study(stage):
    """A stage as the workflow calls it: `stage(study, source, output)`."""
    return lambda study, *files: stage(Setup(study, study_settings(study.config)), *files)


diagnosis_power = _of_study(plan_power)
diagnosis_plan = _of_study(lambda setup, source, output: plan_runs(setup, output))
diagnosis_wave = _of_study(plan_refinement)
diagnosis_identify = _of_study(name_causes)
diagnose = _of_study(conclude)
