"""The error of a reading: its own spread, as far as the others deny it not, and its doubt."""

import numpy as np
import pytest

from calibration.intake.measurements import Measurement
from diagnosis.fit import data_of
from diagnosis.laws.readings import readings_of
from diagnosis.reading_errors import redrawn_share, stated_sd
from diagnosis.table_model.block import Block
from diagnosis.table_model.selection import misfit

SIZES = (2.0, 2.5, 3.0, 3.6, 4.4)


def densities(spreads, n=5, sizes=SIZES):
    return [
        Measurement("bulk_density", 600.0, sd, n, {"particle_diameter_mm": d})
        for sd, d in zip(spreads, sizes, strict=True)
    ]


def means(kind, lever, levels, read):
    pairs = zip(read, levels, strict=True)
    return [Measurement(kind, s.mean(), s.std(ddof=1), len(s), {lever: x}) for s, x in pairs]


def test_a_spread_that_grows_over_the_sizes_is_not_that_of_the_middle():
    """Spreads of a poured density as they were found, in kg/m3."""
    own = np.array([1.46, 4.87, 5.05, 6.25, 13.27])
    found = stated_sd(densities(own))
    assert found[0] < 1.6 * own[0] < 0.5 * np.median(own)
    assert found[-1] > own[-1]
    assert (np.diff(found) > 0.0).all()


def test_spreads_that_are_alike_stand_for_one_another():
    """Five spreads of four degrees of freedom each know one spread to a sixth of it."""
    rng = np.random.default_rng(2)
    tables = np.sqrt(rng.chisquare(4, (400, 5)) / 4.0)
    found = np.array([stated_sd(densities(own)) for own in tables])
    assert np.log(found).std() < 0.65 * np.log(tables).std()
    assert np.sqrt((found**2).mean()) == pytest.approx(1.1, rel=0.05)


def test_one_setting_alone_has_the_doubt_of_its_replicates():
    """Student's 97.5 % point of one degree of freedom is 12.7."""
    [two] = stated_sd(densities([1.0], 2, SIZES[:1]))
    [many] = stated_sd(densities([1.0], 200, SIZES[:1]))
    assert two == pytest.approx(12.706 / 1.96, rel=1e-3)
    assert many == pytest.approx(1.0, rel=0.01)


def test_a_spread_that_is_stated_with_a_single_value_is_taken_as_it_is():
    rows = densities([1.0, 2.0, 9.0, 2.0, 1.0], 1)
    assert data_of(rows).error[0] == pytest.approx([1.0, 2.0, 9.0, 2.0, 1.0])


def test_errors_that_are_drawn_anew_miss_as_the_stated_ones_do():
    """Chi-squares of readings that are right, over errors as they would be stated, are as large as
    those that are drawn of the stated errors: a false alarm is as frequent as it says."""
    rng, true = np.random.default_rng(5), np.array([1.0, 1.5, 2.0, 3.0, 4.0])
    p = []
    for _ in range(300):
        read = 600.0 + true[:, None] * rng.standard_normal((5, 5))
        rows = means("bulk_density", "particle_diameter_mm", SIZES, read)
        error = data_of(rows).error[0]
        seen = (((read.mean(1) - 600.0) / error) ** 2).sum()
        share = redrawn_share(error, np.full(5, 5.0), 200, rng)
        null = ((rng.standard_normal((200, 5)) / share) ** 2).sum(1)
        p.append((null >= seen).mean())
    alarms = int((np.array(p) < 0.05).sum())
    # 15 of 300 are expected
    assert 5 <= alarms <= 27


def test_rebounds_that_are_read_unevenly_raise_no_more_alarms_than_chance():
    """Each height is read half as well, as well or twice as well as the others: of tables without
    an effect 5 % look worse than 95 % of those that are drawn."""
    rng, p = np.random.default_rng(6), []
    for k in range(120):
        heights = np.repeat([40.0, 70.0, 120.0, 200.0, 330.0], 4)
        share = 0.02 * rng.choice([0.5, 1.0, 2.0], 20)
        read = 0.4 * heights[:, None] * (1.0 + share[:, None] * rng.standard_normal((20, 5)))
        own = readings_of(means("drop", "drop_height_mm", heights, read), "drop")
        p.append(misfit({"drop": Block(own, {})}, k, 99)["p"])
    # 6 of 120 are expected
    assert 1 <= int((np.array(p) < 0.05).sum()) <= 13
