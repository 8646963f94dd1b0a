"""Curves of the catalogue's mechanisms are what they change, and no trend that the engine has
without them."""

import numpy as np
import pytest

from benchmarks.rates.strangers import ask
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import Condition
from diagnosis.laws.known import known_curves
from diagnosis.laws.readings import readings_of

WEAK = 7  # of the 21 strengths


def curves(kind, settings, value, unit_sd):
    rig, catalogue = ask.study()
    table = [Measurement(kind, value(at), unit_sd, 5, at) for at in settings]

    def spec_of(experiment, levers):
        return rig.spec(Condition(experiment, levers), rig.settings.seed)

    readings = readings_of(table, kind, {})
    return readings, known_curves(catalogue, spec_of)(readings)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stress_dependent_friction", "wall_adhesion"])
def test_what_acts_on_the_size_of_a_slide_has_no_trend_over_the_rate(name):
    """The engine sees a slide after a slip, later at a faster tilt: by 1 % here without a law."""
    settings = [{"tilt_rate_deg_s": r, "particle_diameter_mm": d}
                for r in (2.0, 18.0) for d in (1.0, 2.0, 4.0)]  # fmt: skip
    _, known = curves("tilt", settings, lambda at: 27.0, 0.4)
    slow, fast = np.split(known[name].curves, 2, axis=1)
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
    fall = own.curves[:, 0] - own.curves[:, 2]
    # the load falls with the angle, which the law raises for small grains
    assert fall[:WEAK] == pytest.approx(3.0 * exponent[:WEAK] * np.log(4.0), rel=0.04)
