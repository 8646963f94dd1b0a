"""Emulators are refined where the posterior is, and the verdict says how rough they are; what is
simulated with the real engine, to show what a change gains."""

import numpy as np
import pytest
from diagnosis_cases import BASE, FACTORS, bench, closed_form
from diagnosis_cases import BASE as RUN

from benchmarks.rates.simulated import salt_settings
from calibration.intake.measurements import Measurement
from dem.spec import parse_spec
from diagnosis import emulator_waves
from diagnosis.bulk import Bulk
from diagnosis.design import plan
from diagnosis.emulator import train
from diagnosis.extend import real_spec
from diagnosis.model import Emulated
from diagnosis.rig import Rig, combine
from diagnosis.settings import catalogue_of, parameters_of

CHANGES = {"runs": 80, "experiments": {"shear": {"mechanisms": ["cohesion"]}}}
FRICTION, ROLLING, ENERGY = 0.6, 0.15, 0.1


def scattered(spec, draw=0):
    """The closed form of a shear test, each run by itself off by some percent."""
    value = closed_form(spec)["shear_stress_kPa"]
    rng = np.random.default_rng([spec["seed"], int(1e6 * value), draw])
    return {"shear_stress_kPa": value * (1.0 + 0.04 * rng.standard_normal())}


def through_waves(draw):
    """(rig, measurements, emulators, what was left, runs) before any wave, after one, after two."""
    settings = salt_settings(CHANGES)
    catalogue = catalogue_of(settings, ["shear"])
    factors = parameters_of(settings, FACTORS, ["shear"])
    rig = Rig(settings, RUN, factors)
    pair = {"static_friction": FRICTION, "rolling_friction": ROLLING}
    measured = []
    for load in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0):
        spec = {"experiment": "shear", "contacts": {"particle_particle": pair}}
        spec |= {"geometry": {"normal_stress_kPa": load}}
        spec |= {"law_parameters": {"surface_energy_J_m2": ENERGY}}
        value = closed_form(spec)["shear_stress_kPa"]
        measured.append(Measurement("shear", value, 0.01 * value, 5, {"normal_stress_kPa": load}))
    rows, specs = plan(rig, catalogue, ["shear"])
    first = len(specs)
    out = []
    for wave in (1, 2, 3):
        metrics = {name: scattered(spec, draw) for name, spec in specs.items()}
        emulators, _ = train(rows, metrics, rig, catalogue)
        emulated = Emulated(emulators, settings, factors, catalogue)
        more, own, found = emulator_waves.plan_wave(Bulk(emulated, measured), rig, wave, first)
        out.append((emulated, found, own))
        rows, specs = rows + more, specs | own
    return rig, measured, out


@pytest.fixture(scope="module")
def refined():
    return through_waves(0)


def error_of(found, mechanism):
    return next(r["error"] for r in found if r["mechanism"] == mechanism)


def test_each_wave_makes_the_emulators_sharper_at_the_mode(refined):
    _, _, (first, second, third) = refined
    before, between, after = (error_of(found, "cohesion") for _, found, _ in (first, second, third))
    assert before > emulator_waves.SHARE
    assert after < between < before


@pytest.mark.slow
def test_the_emulator_comes_nearer_to_the_truth_at_the_mode():
    """The mean squared miss of the measured stresses, over draws of the runs' scatter."""
    misses = []
    for draw in range(12):
        _, measured, (first, _, third) = through_waves(draw)
        for emulated, *_ in (first, third):
            model = emulated.model([m.condition for m in measured], ["cohesion"])
            strength = model.mechanisms[0].strength.coded(ENERGY)
            names = {"static_friction": FRICTION, "rolling_friction": ROLLING}
            theta = [f.coded(names[f.key.split(".")[-1]]) for f in model.factors]
            value, _ = model.predict(np.array([[*theta, strength]]))
            misses.append(np.mean((value[0] / [m.value for m in measured] - 1.0) ** 2))
    before, after = np.array(misses).reshape(-1, 2).mean(0)
    assert after < 0.85 * before


def test_no_wave_beyond_the_cap_and_none_where_emulators_are_sharp(refined):
    rig, measured, ((emulated, *_), *_) = refined
    beyond = rig.settings.waves + 1
    assert emulator_waves.plan_wave(Bulk(emulated, measured), rig, beyond, 40)[:2] == ([], {})
    rough = [
        Measurement("shear", m.value, 0.5 * m.value, 1, m.levers, line=m.line) for m in measured
    ]
    rows, specs, found = emulator_waves.plan_wave(Bulk(emulated, rough), rig, 1, 40)
    assert (rows, specs) == ([], {})
    assert all(r["enough"] for r in found)


KINDS = ["drop", "tilt", "shear", "heap"]
LEVERS = {
    "drop": {"drop_height_mm": 150.0},
    "tilt": {"tilt_rate_deg_s": 5.0},
    "shear": {"normal_stress_kPa": 4.0},
    "heap": {},
}
CONDITIONS = list(LEVERS.items())


@pytest.fixture(scope="module")
def emulated():
    none = {"mechanisms": []}
    return bench(KINDS, {"experiments": dict.fromkeys(KINDS, none), "runs": 200})


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_has_the_parameters_of_its_own_experiment_alone(emulated, kind):
    """The others stand where they stood when the emulator was trained, or base and gain would be of
    another model."""
    model = emulated.model(CONDITIONS)
    theta = np.linspace(-0.9, 0.9, len(model.factors))
    measured = Measurement(kind, 10.0, 1.0, 5, LEVERS[kind])
    spec = real_spec(Rig(emulated.settings, BASE), model, measured, theta, 1)
    found = {
        f"contacts.{pair}.{name}": value
        for pair, values in spec.get("contacts", {}).items()
        for name, value in values.items()
    }
    own = emulated.settings.experiments[kind]
    fixed = own.run.get("contacts", {})
    for factor, coded in zip(model.factors, theta, strict=True):
        _, pair, name = factor.key.split(".")
        if factor.key in own.parameters:
            assert found[factor.key] == pytest.approx(factor.natural(coded))
        else:
            assert found.get(factor.key) == fixed.get(pair, {}).get(name)


PAIRS = [
    ("plastic_restitution", "wall_adhesion", False),  # JKR has a normal force of its own
    ("viscoelastic_restitution", "plastic_restitution", False),  # both are the dashpot
    ("cohesion", "liquid_bridge", False),
    ("liquid_bridge", "wall_adhesion", False),
    ("plastic_restitution", "cohesion", True),  # on different experiments
    ("wall_adhesion", "stress_dependent_friction", True),
    ("air_drag", "plastic_restitution", True),
    ("apex_sampling", "plastic_restitution", True),
    ("cohesion", "size_bias", True),
]


@pytest.mark.parametrize(("first", "second", "together"), PAIRS)
def test_two_laws_are_offered_together_only_where_the_engine_can_have_both(
    emulated, first, second, together
):
    pair = [emulated.catalogue[n] for n in (first, second)]
    assert combine(emulated.settings, pair, CONDITIONS) is together
    assert combine(emulated.settings, pair[::-1], CONDITIONS) is together
    if together:
        model = emulated.model(CONDITIONS, [first, second])
        for kind, levers in CONDITIONS:
            measured = Measurement(kind, 10.0, 1.0, 5, levers)
            theta = np.full(len(model.names), 0.5)
            parse_spec(real_spec(Rig(emulated.settings, BASE), model, measured, theta, 1))


def test_a_pair_that_is_not_measured_together_goes_together(emulated):
    pair = [emulated.catalogue[n] for n in ("plastic_restitution", "wall_adhesion")]
    assert combine(emulated.settings, pair, [("tilt", LEVERS["tilt"])])
