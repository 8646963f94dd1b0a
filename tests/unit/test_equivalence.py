"""Verdicts by a margin: a published equivalence test, and the errors that they promise."""

import numpy as np
import pytest
from scipy import stats

from calibration.errors import CalibrationError
from calibration.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    UNDECIDED,
    limits,
    paired,
    verdict,
    welch,
)
from calibration.statistics.validate import compare


def sample(mean, sd, n):
    """n values of exactly this mean and standard deviation."""
    values = stats.norm.ppf((np.arange(n) + 0.5) / n)
    return mean + sd * (values - values.mean()) / values.std(ddof=1)


def test_the_example_of_lakens():
    """Moery and Calin-Jageman's replication within d = 0.43, a raw difference of 0.384.

    t(182) = -2.69, p = 0.004, 90 % interval -0.188 to 0.248 (Lakens 2017, Social Psychological and
    Personality Science 8:355, and R's TOSTER).
    """
    # t and interval are printed for a pooled variance; Welch has a little fewer than 182 degrees
    sd = np.sqrt((94 * 0.95**2 + 88 * 0.83**2) / 182)
    se, margin = sd * np.sqrt(1 / 95 + 1 / 89), 0.43 * sd
    assert margin == pytest.approx(0.384, abs=0.0005)
    found = compare(sample(5.25, 0.95, 95), sample(5.22, 0.83, 89), margin)
    assert found.equivalence_p == pytest.approx(0.004, abs=0.0005)
    assert (found.difference - margin) / se == pytest.approx(-2.69, abs=0.005)
    assert limits(0.03, se, 182) == pytest.approx((-0.188, 0.248), abs=0.0005)
    assert verdict(*limits(0.03, se, 182), 0.384) == EQUIVALENT
    assert welch(0.95, 95, 0.83, 89) == pytest.approx((se, 182), rel=0.006)


def test_what_is_exact_is_judged_by_its_size():
    assert verdict(*limits(-0.07, 0.0, 1), 1.0) == EQUIVALENT
    assert verdict(*limits(1.07, 0.0, 1), 1.0) == DIFFERENT
    assert welch(0.0, 2, 0.0, 5) == (0.0, np.inf)


def test_wrong_verdicts_are_as_rare_as_stated():
    """At the margin itself both verdicts are wrong by a hair, and each may come in 5 % of cases."""
    rng = np.random.default_rng(1)
    n, draws = 10, 20_000
    d = rng.normal(1.0, 1.0, (draws, n))
    half = stats.t.ppf(0.95, n - 1) * d.std(axis=1, ddof=1) / np.sqrt(n)
    said = [verdict(m - h, m + h, 1.0) for m, h in zip(d.mean(axis=1), half, strict=True)]
    assert said.count(EQUIVALENT) / draws < 0.055
    assert said.count(DIFFERENT) / draws == pytest.approx(0.05, abs=0.005)
    assert said.count(UNDECIDED) / draws > 0.85


def test_pairs_show_bias_and_scatter_apart():
    d = np.array([1.2, 0.7, 1.9, 1.4, 0.3, 1.1])
    found = paired(d, np.full(6, 0.1))
    assert (found.low, found.high) == pytest.approx(
        stats.ttest_1samp(d, 0.0).confidence_interval(0.90)
    )
    assert found.extra**2 == pytest.approx(d.var(ddof=1) - 0.01)
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(2000):
        one = paired(rng.normal(0.5, np.hypot(0.6, 0.8), 12), np.full(12, 0.8))
        held += one.extra_low <= 0.6 <= one.extra_high
    assert held / 2000 == pytest.approx(0.90, abs=0.02)


def test_what_cannot_be_judged_is_said():
    with pytest.raises(CalibrationError, match="1 pair"):
        paired([1.0], [0.1])
    with pytest.raises(CalibrationError, match="no interval"):
        verdict(np.nan, 1.0, 1.0)
