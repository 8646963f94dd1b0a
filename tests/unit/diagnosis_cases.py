"""A diagnosis whose runs are closed forms, so that its stages can be tested without the engine."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

from benchmarks.rates.simulated import salt_heap, salt_settings
from diagnosis import stages
from diagnosis.design import plan
from diagnosis.emulator import train, train_failures
from diagnosis.model import Emulated
from diagnosis.rig import Rig
from diagnosis.settings import catalogue_of, parameters_of
from diagnosis.setup import Setup
from diagnosis.verdict import validate

FACTORS = "config/factors.tsv"
BASE = salt_heap()


def closed_form(spec):
    """Metrics of a run spec (a mapping) by textbook formulas; cohesion adds an intercept and
    steepens the heap."""
    pair = {"static_friction": 0.85, "rolling_friction": 0.23} | spec["contacts"].get(
        "particle_particle", {}
    )
    wall = {"restitution": 0.42, "static_friction": 0.71, "rolling_friction": 0.37} | spec[
        "contacts"
    ].get("particle_wall", {})
    geometry = spec["geometry"]
    energy = spec.get("law_parameters", {}).get("surface_energy_J_m2", 0.0)
    if spec["experiment"] == "drop":
        return {"rebound_height_mm": wall["restitution"] ** 2 * geometry["drop_height_mm"]}
    if spec["experiment"] == "tilt":
        return {"sliding_angle_deg": math.degrees(math.atan(wall["static_friction"]))}
    if spec["experiment"] == "shear":
        slope = 0.9 * pair["static_friction"] + 0.4 * pair["rolling_friction"]
        return {"shear_stress_kPa": slope * geometry["normal_stress_kPa"] + 2.0 * energy}
    angle = 25.0 + 50.0 * pair["rolling_friction"] + 10.0 * wall["rolling_friction"]
    return {"angle_of_repose_deg": angle + 100.0 * energy / spec["particles"]["diameter_mm"]}


def bench(kinds, changes=None):
    """`Emulated` of the experiments, its emulators trained by `closed_form`."""
    settings = salt_settings({"runs": 400} | (changes or {}))
    known = catalogue_of(settings, kinds)
    factors = parameters_of(settings, FACTORS, kinds)
    return trained(Rig(settings, BASE, factors), known, kinds)


def trained(rig, known, kinds, answer=closed_form):
    """`Emulated` of the planned runs; answer(run spec): their metrics, None without a value."""
    rows, specs = plan(rig, known, kinds)
    metrics = {name: answer(spec) for name, spec in specs.items()}
    emulators, _ = train(rows, metrics, rig, known)
    failures = train_failures(rows, metrics, known)
    return Emulated(emulators, rig.settings, rig.factors, known, failures)


def residual(experiment, levers, measured, predicted, sd=1.0):
    """A row of `residuals`."""
    return {"experiment": experiment, "levers": levers, "measured": measured, "sd": sd,
            "predicted": predicted, "standardised": (measured - predicted) / sd}  # fmt: skip


def setup_of(measurements, settings):
    """`Setup` of the salt's study with another table."""
    config = SimpleNamespace(
        experiment="heap", measurements=str(measurements), factors=FACTORS, own_run=BASE,
        of_experiment=lambda kind: kind,
    )  # fmt: skip
    return Setup(SimpleNamespace(config=config), settings)


def files(folder, **names):
    """Files of a stage by their names in a folder."""
    return SimpleNamespace(**{k: str(folder / v) for k, v in names.items()})


def concluded(own, trained, folder):
    """verdict.json of the last two stages, whose files lie in a folder."""
    named = files(
        folder, findings="findings.json", extension="extension.json", plan="extension_plan.json",
        ranking="ranking.svg", table="residuals.csv", residuals="residuals.svg",
    )  # fmt: skip
    stages.name_causes(own, trained, named)
    end = files(
        folder, verdict="verdict.json", page="diagnosis.md", alone="diagnosis.html", gain="gain.svg"
    )
    stages.conclude(own, named, end)
    verdict = json.loads(Path(end.verdict).read_text())
    validate(verdict)
    return verdict
