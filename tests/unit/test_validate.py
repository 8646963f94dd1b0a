"""The comparison with the measurement agrees with scipy's and statsmodels' tests and with the
paper's figures."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from statsmodels.stats.weightstats import CompareMeans, DescrStatsW, ttost_ind

from calibration.errors import CalibrationError
from calibration.statistics.validate import Stated, compare, variance_components
from facts import refused
from paper.audit.paper import Paper

PAPER = Path(__file__).parents[2] / "data" / "paper"


def groups(file):
    table = pd.read_csv(PAPER / file, comment="#")
    return table.pivot(index="group", columns="replicate", values="angle_deg").to_numpy()


@pytest.fixture(scope="module")
def simulated():
    return groups("table13_validation.csv")


@pytest.fixture(scope="module")
def measured():
    return Paper(PAPER).angles()["angle_deg"].to_numpy().reshape(5, 5)


@pytest.mark.parametrize("alpha", [0.05, 0.01])
def test_the_tests_are_welchs_and_schuirmanns(simulated, measured, alpha):
    result = compare(simulated, measured, margin=0.5, alpha=alpha)
    s, m = simulated.ravel(), measured.ravel()
    welch = stats.ttest_ind(s, m, equal_var=False)
    assert result.t == pytest.approx(welch.statistic)
    assert result.t_p == pytest.approx(welch.pvalue)
    means = CompareMeans(DescrStatsW(s), DescrStatsW(m))
    interval = means.tconfint_diff(alpha, usevar="unequal")
    assert (result.difference_low, result.difference_high) == pytest.approx(interval)
    assert result.equivalence_p == pytest.approx(ttost_ind(s, m, -0.5, 0.5, usevar="unequal")[0])
    narrow = means.tconfint_diff(2 * alpha, usevar="unequal")
    assert (result.equivalence_low, result.equivalence_high) == pytest.approx(narrow)
    relative = 100 * (s.mean() / m.mean() - 1)
    assert result.relative_error_percent == pytest.approx(abs(relative))


def test_an_open_comparison_says_how_many_more_runs_would_decide(simulated, measured):
    """With so many of the same mean and scatter Welch's interval lies within the margin, with one
    fewer it does not. None are named where one is shown, or where the readings decide nothing."""
    margin, s, m = 0.62, simulated.ravel(), measured.ravel()
    found = compare(simulated, measured, margin)

    def upper(n):
        parts = s.var(ddof=1) / n, m.var(ddof=1) / m.size
        # the scatter is as badly known as it is, whatever is added to it
        freedom = sum(parts) ** 2 / (parts[0] ** 2 / (24 * n / 25) + parts[1] ** 2 / 24)
        return found.difference + stats.t.ppf(0.95, freedom) * np.sqrt(sum(parts))

    needed = s.size + found.more_runs
    assert upper(needed) <= margin < upper(needed - 1)
    for other in (0.5, 1.0):
        assert compare(simulated, measured, other).more_runs is None


def test_a_stated_mean_is_compared_as_its_readings_are(simulated, measured):
    stated = Stated(measured.mean(), measured.std(ddof=1), measured.size)
    of_readings, of_mean = compare(simulated, measured, 1.0), compare(simulated, stated, 1.0)
    for name, value in of_readings.as_dict().items():
        close = value if value is None else pytest.approx(value, rel=1e-12)
        assert of_mean.as_dict()[name] == close, name


def test_variance_components_are_those_of_the_anova(simulated):
    between, within = variance_components(simulated)
    # F is the between mean square over the within one: 1 + 5 between^2 / within^2 where above 1
    f = stats.f_oneway(*simulated).statistic
    assert between == pytest.approx(within * np.sqrt(max(f - 1, 0) / 5))
    assert within**2 == pytest.approx(simulated.var(axis=1, ddof=1).mean())
    spread = simulated + 3.0 * np.arange(5)[:, None]
    f = stats.f_oneway(*spread).statistic
    between, within = variance_components(spread)
    assert between == pytest.approx(within * np.sqrt((f - 1) / 5))


def test_groups_that_agree_too_well_have_no_component():
    assert variance_components([[1.0, 3.0], [3.0, 1.0]]) == (0.0, pytest.approx(np.sqrt(2)))


@pytest.mark.parametrize(
    ("s", "m", "margin", "word"),
    [
        ([[1.0]], [1.0, 2.0], 1.0, "1 simulated"),
        ([[1.0, 2.0]], [1.0], 1.0, "1 measured"),
        ([[1.0, np.nan]], [1.0, 2.0], 1.0, "simulated value 2"),
        ([[1.0, 1.0]], [2.0, 2.0], 1.0, "scatter"),
        ([[1.0, 2.0]], [1.0, 2.0], 0.0, "margin"),
    ],
)
def test_values_that_cannot_be_compared_are_refused(s, m, margin, word):
    with refused(CalibrationError, word):
        compare(s, m, margin)
