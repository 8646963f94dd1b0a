"""Every mechanism of the catalogue: a valid run spec, a strength that goes both ways, the physics
of its reading, and no trend in its curves that the engine has without it."""

import numpy as np
import pytest

from benchmarks.rates.simulated import salt_settings
from benchmarks.rates.strangers import ask
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import Condition
from dem.spec import parse_spec
from diagnosis.catalogue import load_catalogue
from diagnosis.laws.known import known_curves
from diagnosis.laws.readings import readings_of
from diagnosis.rig import Rig

CATALOGUE = load_catalogue()
WEAK = 7  # of the 21 strengths of a curve
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
def test_strength_goes_both_ways_from_where_it_is_weakest(name):
    s = CATALOGUE[name].strength
    for share in (0.0, 0.37, 1.0):
        assert s.coded(s.natural(share)) == pytest.approx(share, abs=1e-12)
    assert s.natural(s.weakest) == pytest.approx(s.low if s.off is None else s.off)
    assert 0.0 <= s.weakest <= 1.0


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


def curves(kind, settings, value, unit_sd):
    rig, catalogue = ask.study()
    table = [Measurement(kind, value(at), unit_sd, 5, at) for at in settings]

    def spec_of(experiment, levers):
        return rig.spec(Condition(experiment, levers), rig.settings.seed)

    readings = readings_of(table, kind, {})
    return readings, {s.name: s for _, s in known_curves(catalogue, spec_of)(readings)}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stress_dependent_friction", "wall_adhesion"])
def test_what_acts_on_the_size_of_a_slide_has_no_trend_over_the_rate(name):
    """The engine sees a slide after a slip, later at a faster tilt: by 1 % here without a law."""
    settings = [{"tilt_rate_deg_s": r, "particle_diameter_mm": d}
                for r in (2.0, 18.0) for d in (1.0, 2.0, 4.0)]  # fmt: skip
    _, known = curves("tilt", settings, lambda at: 27.0, 0.4)
    slow, fast = np.split(known[name].mean, 2, axis=1)
    # a strong law moves the angle, and with it what the slip adds
    assert np.ptp(slow[:WEAK], axis=1).max() > 0.05
    assert np.abs(fast - slow)[:WEAK].max() < 2e-3


@pytest.mark.slow
def test_friction_over_the_load_is_the_power_that_was_asked_for():
    """mu ~ F^-n and F ~ d^3: over a factor of four in size the logarithm falls by 3 n ln 4."""
    settings = [{"tilt_rate_deg_s": 5.0, "particle_diameter_mm": d} for d in (1.0, 2.0, 4.0)]
    _, known = curves("tilt", settings, lambda at: 27.0, 0.4)
    own = known["stress_dependent_friction"]
    exponent = own.label / 3.0  # the strength goes from 0 to 1/3
    fall = own.mean[:, 0] - own.mean[:, 2]
    # the load falls with the angle, which the law raises for small grains
    assert fall[:WEAK] == pytest.approx(3.0 * exponent[:WEAK] * np.log(4.0), rel=0.04)
