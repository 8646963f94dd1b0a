"""The screening of frozen runs and the paper's design, recomputed with statsmodels."""

import itertools
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from scipy import stats
from statsmodels.stats.anova import anova_lm
from statsmodels.stats.outliers_influence import variance_inflation_factor

from calibration.stages.screening import aliasing
from calibration.statistics.screening import screen
from frozen import FROZEN

PAPER = Path(__file__).parents[2] / "data/paper"
CODES = list("ABCDEFG")


def kept_runs():
    names = ("salt", "salt-2", "salt-3", "salt-4")
    tables = [pd.read_csv(FROZEN / n / "screening/runs.csv") for n in names]
    table = pd.concat(tables, ignore_index=True).dropna(subset="response")
    return table.assign(cell="row " + table["run"].astype(str))


@pytest.fixture(scope="module")
def runs():
    return kept_runs()


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
