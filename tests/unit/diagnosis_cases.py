"""A diagnosis whose runs are closed forms, so that its stages can be tested without the engine."""

import math

from benchmarks.rates.simulated import salt_heap, salt_settings
from diagnosis.design import plan
from diagnosis.emulator import train
from diagnosis.model import Emulated
from diagnosis.rig import Rig
from diagnosis.settings import catalogue_of, parameters_of

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
    settings = salt_settings({"runs_per_input": 6} | (changes or {}))
    known = catalogue_of(settings, kinds)
    factors = parameters_of(settings, FACTORS, kinds)
    rows, specs = plan(Rig(settings, BASE, factors), known, kinds)
    metrics = {name: closed_form(spec) for name, spec in specs.items()}
    emulators, _ = train(rows, metrics, settings, factors)
    return Emulated(emulators, settings, factors, known)
