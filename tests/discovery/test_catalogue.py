"""Every mechanism of the catalogue: a valid run spec, a strength that goes both ways, the physics
of its reading."""

import numpy as np
import pytest

from benchmarks.rates.simulated import rate_settings, salt_settings
from calibration.intake.quantities import Condition
from dem.run import run
from dem.spec import parse_spec
from diagnosis.catalogue import load_catalogue
from diagnosis.rig import Rig

CATALOGUE = load_catalogue()
SETTINGS = salt_settings()
RIG = Rig(SETTINGS, {})
LEVERS = {"drop": {"drop_height_mm": 150.0}, "shear": {"normal_stress_kPa": 5.0}}
TAKEN = {
    "laws": {"damping": "plastic", "friction": "stress_dependent", "cohesion": "sjkr"},
    "law_parameters": {
        "yield_velocity_m_s": 0.1,
        "friction_exponent": 0.1,
        "friction_reference_force_N": 0.01,
        "cohesion_energy_density_J_m3": 100.0,
    },
}
"""Laws with parameters of their own in slots that mechanisms put theirs in."""


@pytest.mark.parametrize(
    "name", ["liquid_bridge", "viscoelastic_restitution", "stress_dependent_friction"]
)
def test_a_law_that_takes_the_place_of_another_leaves_nothing_of_it(name):
    mechanism = CATALOGUE[name]
    spec = mechanism.apply({"experiment": "heap"} | TAKEN, mechanism.strength.high)
    slots = [slot for slot in TAKEN["laws"] if spec["laws"][slot] != TAKEN["laws"][slot]]
    assert (slots == []) == (name == "stress_dependent_friction")
    parse_spec(spec)


def test_a_study_is_diagnosed_under_the_parameters_of_its_laws():
    """They were the defaults, or missing."""
    for experiment in ("heap", "shear"):
        levers = LEVERS.get(experiment, {})
        spec = parse_spec(Rig(SETTINGS, TAKEN).spec(Condition(experiment, levers), 0))
        for key, value in TAKEN["law_parameters"].items():
            assert getattr(spec.law_parameters, key) == value


@pytest.mark.parametrize("name", sorted(CATALOGUE))
@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_each_mechanism_makes_a_valid_spec(name, share):
    mechanism = CATALOGUE[name]
    # an experiment without settings of its own cannot be diagnosed before a user gives them
    for experiment in sorted(set(mechanism.experiments) & set(SETTINGS.experiments)):
        spec = RIG.spec(Condition(experiment, LEVERS.get(experiment, {})), 1)
        parse_spec(spec)
        before = repr(spec)
        parse_spec(mechanism.apply(spec, mechanism.strength.natural(share)))
        assert repr(spec) == before, "the given spec was changed"


@pytest.mark.parametrize("name", sorted(CATALOGUE))
def test_strength_goes_both_ways_and_rises_from_where_it_is_off(name):
    s = CATALOGUE[name].strength
    for share in (0.0, 0.37, 1.0):
        assert s.coded(s.natural(share)) == pytest.approx(share, abs=1e-12)
    rising = s.natural(s.rising(5))
    assert rising[0] == pytest.approx(s.low if s.off is None else s.off)
    away = abs(s.rising(5) - s.rising(5)[0])
    assert (np.diff(away) > 0.0).all()
    assert away[-1] >= 0.5
    assert ((rising >= s.low * (1 - 1e-12)) & (rising <= s.high * (1 + 1e-12))).all()


def test_reading_a_tilt_late_adds_what_the_closed_form_says():
    lag = CATALOGUE["tilt_detection_lag"].observe
    angle = np.degrees(np.arctan(0.5))
    # 5 deg/s and 1 mm of slip at mu = 0.5: 0.92 deg
    assert lag(angle, {"tilt_rate_deg_s": 5.0}, 1.0) - angle == pytest.approx(0.92, abs=0.005)
    excess = [lag(angle, {"tilt_rate_deg_s": w}, 1.0) - angle for w in (2.0, 16.0)]
    assert excess[1] / excess[0] == pytest.approx(8 ** (2 / 3))


def test_the_mean_apex_deficit_is_that_of_random_phases():
    phase = np.random.default_rng(1).uniform(-0.5, 0.5, 200_000) * 0.04
    deficit = 1e3 * 0.5 * 9.81 * phase**2
    read = CATALOGUE["apex_sampling"].observe(50.0, {"output_interval_s": 0.04}, 1.0)
    assert 50.0 - read == pytest.approx(deficit.mean(), rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n, m in CATALOGUE.items() if m.multiplies])
def test_one_that_multiplies_a_lever_is_the_base_model_at_another_lever(name, tmp_path):
    mechanism = CATALOGUE[name]
    settings, metrics = rate_settings(), []
    for experiment in sorted(set(mechanism.experiments) & set(settings.experiments)):
        levers = {
            n: (lo + hi) / 2 for n, (lo, hi) in settings.experiments[experiment].levers.items()
        }
        levers |= {"particle_count": 400} if "particle_count" in levers else {}
        own, strength = levers[mechanism.multiplies], mechanism.strength.natural(0.8)
        plain = Rig(settings, {}).spec(Condition(experiment, levers), 3)
        moved = {mechanism.multiplies: own * strength}
        other = Rig(settings, {}).spec(Condition(experiment, levers | moved), 3)
        for k, spec in enumerate((mechanism.apply(plain, strength), other)):
            metrics.append(run(parse_spec(spec), tmp_path / f"{experiment}{k}")["metrics"])
        assert metrics[-1] == pytest.approx(metrics[-2], rel=1e-12)
