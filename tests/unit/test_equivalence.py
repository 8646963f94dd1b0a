"""Verdicts by a margin: a published equivalence test, and the errors that they promise; the
comparison with the measurement agrees with scipy's and statsmodels' tests."""

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.weightstats import CompareMeans, DescrStatsW, ttost_ind

from calibration.errors import CalibrationError
from calibration.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    EXACT,
    UNDECIDABLE,
    UNDECIDED,
    Error,
    Stated,
    compare,
    decide_difference,
    limits,
    rms_interval,
    together,
    verdict,
)
from facts import refused
from paper_tables import measured_angles, simulated_angles


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
    assert found["equivalence_p"] == pytest.approx(0.004, abs=0.0005)
    assert (found["difference"] - margin) / se == pytest.approx(-2.69, abs=0.005)
    assert limits(0.03, se, 182) == pytest.approx((-0.188, 0.248), abs=0.0005)
    assert verdict(*limits(0.03, se, 182), 0.384) == EQUIVALENT
    own, other = Error(0.95 / np.sqrt(95), 94), Error(0.83 / np.sqrt(89), 88)
    assert own.beside(other) == pytest.approx((se, 182), rel=0.006)


def test_what_is_exact_is_judged_by_its_size():
    assert verdict(*limits(-0.07, 0.0, 1), 1.0) == EQUIVALENT
    assert verdict(*limits(1.07, 0.0, 1), 1.0) == DIFFERENT
    assert Error(0.0, 1).beside(Error(0.0, 4)) == (0.0, np.inf)


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


@pytest.mark.parametrize(
    ("difference", "theirs", "word"),
    [
        (0.3, Error(0.8, 24), UNDECIDABLE),  # 0.8 leaves 1.4 to each side, however often we run
        (0.3, Error(0.1, 24), UNDECIDED),
        (3.0, Error(0.8, 24), UNDECIDED),  # outside by more than what theirs leaves
        (0.3, EXACT, UNDECIDED),
    ],
)
def test_what_the_other_side_leaves_open_is_undecidable(difference, theirs, word):
    found = decide_difference(difference, Error(2.0, 3, 4), theirs, 1.0)
    assert found.verdict == word
    assert (found.more_runs is None) == (word == UNDECIDABLE)
    # the same difference of very many runs of ours
    many = decide_difference(difference, Error(1e-6, 1e9, 10**9), theirs, 1.0).verdict
    assert (many == UNDECIDABLE) == (word == UNDECIDABLE)


@pytest.mark.slow
def test_the_rms_of_true_differences_is_held_as_often_as_stated():
    rng, draws, rows = np.random.default_rng(4), 600, 12
    true = rng.normal(0.0, 1.0, rows)
    rms, error = np.sqrt(np.mean(true**2)), 1.1
    held = 0
    for _ in range(draws):
        square = np.mean((true + rng.normal(0.0, error, rows)) ** 2)
        low, high = rms_interval(square, rows, error**2)
        held += low <= rms <= high
    assert held / draws > 0.88
    assert rms_interval(2.25, 5, 0.0) == (1.5, 1.5)


def test_a_table_is_judged_as_one_and_its_chance_is_that_of_chi_square():
    d = np.array([0.4, -1.9, 1.2, -0.7, 2.2])
    found = together(d, 0.6, 0.9, 5, 1.0)
    assert found.p == pytest.approx(stats.chi2.sf((d**2).sum() / (0.36 + 0.81), 5))
    assert found.beyond**2 == pytest.approx(np.mean(d**2) - 1.17)
    assert (found.mean, found.n) == (pytest.approx(d.mean()), 5)
    assert together(4.0 + d, 0.6, 0.9, 5, 1.0).decision.verdict == DIFFERENT
    assert together(0.05 * d, 0.1, 0.1, 5, 1.0).decision.verdict == EQUIVALENT
    assert together(0.5 * d, 0.1, 1.5, 5, 1.0).decision.verdict == UNDECIDABLE


def test_what_cannot_be_judged_is_said():
    with refused(CalibrationError, "nan", "1"):
        verdict(np.nan, 1.0, 1.0)


simulated = pytest.fixture(simulated_angles, scope="module", name="simulated")
measured = pytest.fixture(measured_angles, scope="module", name="measured")


@pytest.mark.parametrize("alpha", [0.05, 0.01])
def test_the_tests_are_welchs_and_schuirmanns(simulated, measured, alpha):
    result = compare(simulated, measured, margin=0.5, alpha=alpha)
    s, m = simulated.ravel(), measured.ravel()
    welch = stats.ttest_ind(s, m, equal_var=False)
    assert result["t"] == pytest.approx(welch.statistic)
    assert result["t_p"] == pytest.approx(welch.pvalue)
    means = CompareMeans(DescrStatsW(s), DescrStatsW(m))
    interval = means.tconfint_diff(alpha, usevar="unequal")
    assert (result["difference_low"], result["difference_high"]) == pytest.approx(interval)
    assert result["equivalence_p"] == pytest.approx(ttost_ind(s, m, -0.5, 0.5, usevar="unequal")[0])
    narrow = means.tconfint_diff(2 * alpha, usevar="unequal")
    assert (result["equivalence_low"], result["equivalence_high"]) == pytest.approx(narrow)
    relative = 100 * (s.mean() / m.mean() - 1)
    assert result["relative_error_percent"] == pytest.approx(abs(relative))


def test_an_open_comparison_says_how_many_more_runs_would_decide(simulated, measured):
    """With so many of the same mean and scatter Welch's interval lies within the margin, with one
    fewer it does not. None are named where one is shown, or where the readings decide nothing."""
    margin, s, m = 0.62, simulated.ravel(), measured.ravel()
    found = compare(simulated, measured, margin)

    def upper(n):
        parts = s.var(ddof=1) / n, m.var(ddof=1) / m.size
        # the scatter is as badly known as it is, whatever is added to it
        freedom = sum(parts) ** 2 / (parts[0] ** 2 / (24 * n / 25) + parts[1] ** 2 / 24)
        return found["difference"] + stats.t.ppf(0.95, freedom) * np.sqrt(sum(parts))

    needed = s.size + found["more_runs"]
    assert upper(needed) <= margin < upper(needed - 1)
    for other in (0.5, 1.0):
        assert compare(simulated, measured, other)["more_runs"] is None


def test_a_stated_mean_is_compared_as_its_readings_are(simulated, measured):
    stated = Stated(measured.mean(), measured.std(ddof=1), measured.size)
    of_readings, of_mean = compare(simulated, measured, 1.0), compare(simulated, stated, 1.0)
    for name, value in of_readings.items():
        close = value if value is None else pytest.approx(value, rel=1e-12)
        assert of_mean[name] == close, name


@pytest.mark.parametrize(
    ("s", "m", "margin", "word"),
    [
        ([[1.0]], [1.0, 2.0], 1.0, "1 simulated"),
        ([[1.0, 2.0]], [1.0], 1.0, "1 measured"),
        ([[1.0, np.nan]], [1.0, 2.0], 1.0, "simulated"),
        ([[1.0, 1.0]], [2.0, 2.0], 1.0, "scatter"),
        ([[1.0, 2.0]], [1.0, 2.0], 0.0, "margin"),
    ],
)
def test_values_that_cannot_be_compared_are_refused(s, m, margin, word):
    with refused(CalibrationError, word):
        compare(s, m, margin)
