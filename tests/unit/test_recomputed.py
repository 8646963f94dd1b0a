"""The statistics of frozen runs, recomputed with statsmodels: screening, aliases, and two verdicts
of the reproduction."""

import itertools
from decimal import ROUND_HALF_UP, Decimal
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from scipy import stats
from statsmodels.stats.anova import anova_lm
from statsmodels.stats.outliers_influence import variance_inflation_factor
from statsmodels.stats.weightstats import CompareMeans, DescrStatsW

from calibration.stages.screening import aliasing
from calibration.statistics.screening import screen
from frozen import FROZEN

PAPER = Path(__file__).parents[2] / "data/paper"
CODES = list("ABCDEFG")
MARGIN = 1.0


def kept_runs():
    names = ("salt", "salt-2", "salt-3", "salt-4")
    tables = [pd.read_csv(FROZEN / n / "screening/runs.csv") for n in names]
    table = pd.concat(tables, ignore_index=True).dropna(subset="response")
    return table.assign(cell="row " + table["run"].astype(str))


@pytest.fixture(scope="module")
def runs():
    return kept_runs()


@pytest.fixture(scope="module")
def rows():
    return pd.read_csv(FROZEN / "salt/reproduction/reproduction.csv").set_index("id")


def test_pure_error_and_lack_of_fit_are_those_of_two_nested_models(runs):
    main = smf.ols("response ~ " + " + ".join(CODES), runs).fit()
    cells = smf.ols("response ~ cell", runs).fit()  # a mean for each row of the design
    lack = anova_lm(main, cells).iloc[1]
    ours = screen(runs, CODES, runs["response"])
    table = ours.anova.set_index("source")
    assert table.loc["Pure Error", ["sum_sq", "df"]].tolist() == pytest.approx(
        [cells.ssr, cells.df_resid]
    )
    assert table.loc["Lack of Fit", ["sum_sq", "df", "F", "p"]].tolist() == pytest.approx(
        lack[["ss_diff", "df_diff", "F", "Pr(>F)"]].tolist()
    )
    # effects against the pure error: the covariance of the main effects' model with its variance
    sd = np.sqrt(cells.ssr / cells.df_resid)
    error = 2.0 * sd * np.sqrt(np.diag(main.normalized_cov_params))[1:]
    t = 2.0 * main.params[CODES].to_numpy() / error
    assert ours.table["se"].to_numpy() == pytest.approx(error)
    assert ours.table["p"].to_numpy() == pytest.approx(2 * stats.t.sf(abs(t), cells.df_resid))
    x = np.column_stack([np.ones(len(runs)), runs[CODES]])
    inflated = [variance_inflation_factor(x, k + 1) for k in range(7)]
    assert ours.table["vif"].to_numpy() == pytest.approx(inflated)


def test_the_interaction_that_takes_the_lack_of_fit_is_that_of_statsmodels(runs):
    found = aliasing(runs, CODES)["lack_of_fit"]
    plain = smf.ols("response ~ " + " + ".join(CODES), runs).fit()
    taken = {}
    for a, b in itertools.combinations(CODES, 2):
        more = smf.ols(f"response ~ {' + '.join(CODES)} + {a}:{b}", runs).fit()
        taken[a + b] = plain.ssr - more.ssr
    most = max(taken.values())
    assert set(found["largest"]) == {k for k, v in taken.items() if np.isclose(v, most)}
    assert {"AG", "BD", "CE"} == set(found["largest"])


def test_a_plackett_burman_effect_carries_a_third_of_each_other_pair():
    table = pd.read_csv(PAPER / "table06_plackett_burman.csv", comment="#")
    found = aliasing(table.rename(columns={"angle_deg": "response"}), CODES)
    for code, pairs in found["aliases"].items():
        assert {frozenset(p) for p in pairs} == {
            frozenset(p) for p in itertools.combinations(set(CODES) - {code}, 2)
        }
        assert np.abs(list(pairs.values())) == pytest.approx(1 / 3)
        for pair, share in pairs.items():  # the slope of the pair's column on the effect's
            column = table[pair[0]] * table[pair[1]]
            assert np.polyfit(table[code], column, 1)[0] == pytest.approx(share)
    assert found["vif"] == pytest.approx(1.0)
    assert found["lack_of_fit"] is None


def test_effects_differ_from_the_papers_as_recomputed(runs, rows):
    cells = smf.ols("response ~ cell", runs).fit()
    main = smf.ols("response ~ " + " + ".join(CODES), runs).fit()
    table = pd.read_csv(PAPER / "table06_plackett_burman.csv", comment="#")
    repeats = pd.read_csv(PAPER / "table13_validation.csv", comment="#")["angle_deg"]
    theirs = 2 * repeats.std() / np.sqrt(12)
    n = len(repeats) - 1
    said = {}
    for k, code in enumerate(CODES, start=1):
        own = 2 * np.sqrt(cells.mse_resid * np.diag(main.normalized_cov_params)[k])
        # a standard error and degrees of freedom by Satterthwaite
        se = np.hypot(own, theirs)
        freedom = se**4 / (own**4 / cells.df_resid + theirs**4 / n)
        # the paper's, in the decimals of its own table: -6.275 is a half, and goes away from zero
        signs, angles = table[code].map(int), table["angle_deg"].map(str)
        printed = (signs * angles.map(Decimal)).sum()
        printed = (printed / 6).quantize(Decimal("0.01"), ROUND_HALF_UP)
        apart = 2 * main.params[code] - float(printed)
        reach = stats.t.ppf(0.95, freedom) * se
        row = rows.loc[f"table07.{code}.effect"]
        assert row[["low", "high"]].tolist() == pytest.approx([apart - reach, apart + reach])
        said[code] = abs(apart) - reach > MARGIN
        assert (row["agreement"] == "different") == said[code]
    assert sum(said.values()) == 6


def test_the_validated_mean_is_judged_as_recomputed(rows):
    ours = pd.read_csv(FROZEN / "salt/validation/runs.csv")["response"].dropna()
    theirs = pd.read_csv(PAPER / "table13_validation.csv", comment="#")["angle_deg"]
    both = CompareMeans(DescrStatsW(ours), DescrStatsW(theirs))
    low, high = both.tconfint_diff(alpha=0.10, usevar="unequal")
    row = rows.loc["table13.mean.salt"]
    # the paper prints the mean of its 25 angles to two decimals
    shift = round(theirs.mean(), 2) - theirs.mean()
    assert row[["low", "high"]].tolist() == pytest.approx([low - shift, high - shift], abs=1e-6)
