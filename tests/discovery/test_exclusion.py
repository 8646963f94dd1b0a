"""Limits hold the truth as often as they say, and are no wider than the data ask for; what a plan
would show is shown as often as stated."""

import numpy as np
import pytest
from scipy.stats import binom

from calibration.intake.measurements import Measurement
from diagnosis.laws.readings import readings_of
from diagnosis.power import POWER, power
from diagnosis.table_model.found import discover
from diagnosis.table_model.law import slope_limits
from diagnosis.table_model.selection import blocks_of

HEIGHTS, SIZES = (50.0, 80.0, 120.0, 180.0, 250.0), (1.5, 2.0, 3.0, 4.0)
NOISE, REPLICATES = 0.02, 5


def drops(change=0.0, rng=None, shared=0.0):
    """Rebounds whose restitution changes by a share over the range of speeds, along a logarithm;
    without rng a plan of guesses; shared: standard deviation of an error of each height."""
    out = []
    for h in HEIGHTS:
        along = np.log(h / HEIGHTS[0]) / np.log(HEIGHTS[-1] / HEIGHTS[0])
        true = h * 0.7**2 * (1.0 + change) ** (2.0 * along)
        true *= np.exp(shared * rng.standard_normal()) if rng else 1.0
        for d in SIZES:
            read = true * (1.0 + NOISE * (rng.standard_normal(REPLICATES) if rng else np.zeros(1)))
            sd = read.std(ddof=1) if rng else NOISE * true
            levers = {"drop_height_mm": h, "particle_diameter_mm": d}
            out.append(Measurement("drop", read.mean(), sd, REPLICATES, levers))
    return out


def by_speed(measurements):
    """Limits of restitution over speed."""
    [block] = blocks_of([readings_of(measurements, "drop")], None).values()
    return slope_limits(block, block.terms["drop:restitution(speed)"].law)


@pytest.mark.slow
@pytest.mark.parametrize("shared", [0.0, 0.04])
def test_the_limits_of_a_slope_hold_the_truth(shared):
    rng, sets, change = np.random.default_rng(11), 40, -0.03
    rows = [by_speed(drops(change, rng, shared)) for _ in range(sets)]
    outside = sum(
        (low is not None and change < low) or (high is not None and change > high)
        for low, high in rows
    )
    # either side misses in 5 %: more than so many of forty have a chance below 1 %
    assert outside <= binom.ppf(0.99, sets, 0.1)
    if shared:
        return
    assert all(None not in r for r in rows)
    # a straight line by least squares knows the slope of the logarithm to this
    x = np.repeat(np.log(HEIGHTS) / np.log(HEIGHTS[-1] / HEIGHTS[0]), len(SIZES))
    error = NOISE / REPLICATES**0.5 / 2.0 / np.sqrt(((x - x.mean()) ** 2).sum())
    width = np.median([high - low for low, high in rows])
    # each height may have an error of its own: that is paid for
    assert 0.8 < width / (2.0 * 1.645 * error) < 4.0


@pytest.fixture(scope="module")
def rows():
    return {r["law"]: r for r in power(drops())}


def test_a_slope_is_shown_from_a_few_of_its_standard_errors(rows):
    row = rows["drop:restitution(speed)"]
    x = np.repeat(np.log(HEIGHTS) / np.log(HEIGHTS[-1] / HEIGHTS[0]), len(SIZES))
    error = NOISE / REPLICATES**0.5 / 2.0 / np.sqrt(((x - x.mean()) ** 2).sum())
    # a test of this slope alone would show 2.8 standard errors in 80 %; the family asks for more
    assert 2.5 < abs(row["detectable"]) / error < 8.0
    assert row["share"] >= POWER


@pytest.mark.slow
def test_measurements_show_it_as_often_as_stated(rows):
    change, rng = rows["drop:restitution(speed)"]["detectable"], np.random.default_rng(3)
    sets = 20
    shown = sum(discover(drops(change, rng)).p < 0.05 for _ in range(sets))
    # 80 % are stated; below twelve of twenty have a chance of 1 %
    assert shown >= 12
