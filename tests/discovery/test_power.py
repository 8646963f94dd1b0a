"""What a plan would show: by simulation as often as stated, and no better than the errors allow."""

import numpy as np
import pytest

from calibration.intake.measurements import Measurement
from diagnosis.power import POWER, power
from diagnosis.table_model.found import discover

HEIGHTS, SIZES = (50.0, 80.0, 120.0, 180.0, 250.0), (1.5, 2.0, 3.0, 4.0)
SHARE = 0.02  # error of one reading of five


def plan(change=0.0, rng=None):
    """Rebounds with a change of the restitution over the speeds; without noise unless rng."""
    out = []
    for h in HEIGHTS:
        along = np.log(h / HEIGHTS[0]) / np.log(HEIGHTS[-1] / HEIGHTS[0])
        for d in SIZES:
            value = h * 0.7**2 * (1.0 + change) ** (2.0 * along)
            sd = SHARE * value
            value += sd / 5**0.5 * rng.standard_normal() if rng else 0.0
            levers = {"drop_height_mm": h, "particle_diameter_mm": d}
            out.append(Measurement("drop", value, sd, 5, levers))
    return out


@pytest.fixture(scope="module")
def rows():
    return {r["law"]: r for r in power(plan())}


def test_a_slope_is_shown_from_a_few_of_its_standard_errors(rows):
    row = rows["drop:restitution(speed)"]
    x = np.repeat(np.log(HEIGHTS) / np.log(HEIGHTS[-1] / HEIGHTS[0]), len(SIZES))
    error = SHARE / 5**0.5 / 2.0 / np.sqrt(((x - x.mean()) ** 2).sum())
    # a test of this slope alone would show 2.8 standard errors in 80 %; the family asks for more
    assert 2.5 < abs(row["detectable"]) / error < 8.0
    assert row["share"] >= POWER


@pytest.mark.slow
def test_measurements_show_it_as_often_as_stated(rows):
    change, rng = rows["drop:restitution(speed)"]["detectable"], np.random.default_rng(3)
    sets = 20
    shown = sum(discover(plan(change, rng)).p < 0.05 for _ in range(sets))
    # 80 % are stated; below twelve of twenty have a chance of 1 %
    assert shown >= 12
