"""The statistics of frozen runs, recomputed with statsmodels alone: nothing of `calibration` or
`paper` is used but the tables that are judged."""

import itertools
import json
import re
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


def test_what_the_slow_pour_leaves_has_the_chance_of_its_own_scatter():
    found = json.loads((FROZEN / "salt-paper/disagreement/disagreement.json").read_text())
    slow = json.loads((FROZEN / "salt-slow/validation/validation.json").read_text())
    angles = pd.read_csv(PAPER / "table13_validation.csv", comment="#")["angle_deg"]
    variance = slow["simulated_sd"] ** 2 + angles.var()
    cause = "pour of 6500 grains a second"
    for name in ("Table 6", "Table 10", "Table 11"):
        off = [r["theirs"] - r[cause] for r in found[name]["rows"]]
        (own,) = (r for r in found[name]["ranking"] if r["cause"] == cause)
        chance = stats.chi2.sf(np.sum(np.square(off)) / variance, len(off))
        assert own["p_left"] == pytest.approx(chance, rel=1e-6)
        assert ("unexplained" in found[name]["sentence"]) == (chance < 0.05)


STUDIES = ("salt", "salt-slow", "salt-paper")


def surface_of(name):
    """(the kept statistics, coefficients and ANOVA of a study's surface, the fit of statsmodels,
    the terms of both in the same order, the runs)."""
    folder = FROZEN / name / "response_surface"
    runs = pd.read_csv(folder / "runs.csv").dropna(subset="response")
    codes = [f["code"] for f in json.loads((folder / "region.json").read_text())]
    pairs = list(itertools.combinations(codes, 2))
    ours = ["Intercept", *codes, *(a + b for a, b in pairs), *(c + "²" for c in codes)]
    theirs = ["Intercept", *codes, *(f"{a}:{b}" for a, b in pairs)]
    theirs += [f"I({c} ** 2)" for c in codes]
    # patsy takes C for categorical() and E and I are its own words: factors get other names
    safe = {c: f"x_{c}" for c in codes}
    theirs = [re.sub(r"\b([A-G])\b", lambda m: safe[m[1]], t) for t in theirs]
    fit = smf.ols("response ~ " + " + ".join(theirs[1:]), runs.rename(columns=safe)).fit()
    statistics = json.loads((folder / "response_surface.json").read_text())["statistics"]
    tables = (pd.read_csv(folder / f"{t}.csv") for t in ("coefficients", "anova"))
    return statistics, *tables, fit, dict(zip(ours, theirs, strict=True)), runs, codes


@pytest.mark.parametrize("name", STUDIES)
def test_the_statistics_of_a_surface_are_those_of_statsmodels(name):
    said, coefficients, _, fit, terms, runs, _ = surface_of(name)
    left_out = fit.resid / (1.0 - fit.get_influence().hat_matrix_diag)
    total = float(((runs["response"] - runs["response"].mean()) ** 2).sum())
    spread = np.sqrt(fit.mse_resid)
    assert said["R2"] == pytest.approx(fit.rsquared)
    assert said["R2_adj"] == pytest.approx(fit.rsquared_adj)
    assert said["R2_pred"] == pytest.approx(1.0 - float(left_out @ left_out) / total)
    assert said["CV_percent"] == pytest.approx(100.0 * spread / runs["response"].mean())
    assert said["sd"] == pytest.approx(spread)
    fitted = fit.fittedvalues  # adequate precision: their range over their mean standard error
    error = np.sqrt(len(terms) * fit.mse_resid / len(runs))
    assert said["adequate_precision"] == pytest.approx((fitted.max() - fitted.min()) / error)
    own = coefficients.set_index("term")
    for ours, theirs in terms.items():
        expected = [fit.params[theirs], fit.bse[theirs], fit.pvalues[theirs]]
        assert own.loc[ours, ["estimate", "se", "p"]].tolist() == pytest.approx(expected), ours


@pytest.mark.parametrize("name", STUDIES)
def test_the_analysis_of_variance_of_a_surface_is_that_of_statsmodels(name):
    _, _, table, fit, terms, runs, codes = surface_of(name)
    anova = table.set_index("source")
    model = anova.loc["Model", ["sum_sq", "df", "F", "p"]].tolist()
    assert model == pytest.approx([fit.ess, fit.df_model, fit.fvalue, fit.f_pvalue])
    assert anova.loc["Residual", ["sum_sq", "df"]].tolist() == pytest.approx(
        [fit.ssr, fit.df_resid]
    )
    for ours, theirs in list(terms.items())[1:]:  # each term last
        f = fit.tvalues[theirs] ** 2
        row = anova.loc[ours, ["sum_sq", "F", "p"]].tolist()
        assert row == pytest.approx([f * fit.mse_resid, f, fit.pvalues[theirs]]), ours
    cell = runs[codes].round(9).astype(str).agg(" ".join, axis=1)
    cells = smf.ols("response ~ cell", runs.assign(cell=cell)).fit()
    f = (fit.ssr - cells.ssr) / (fit.df_resid - cells.df_resid) / cells.mse_resid
    p = stats.f.sf(f, fit.df_resid - cells.df_resid, cells.df_resid)
    assert anova.loc["Lack of Fit", ["F", "p"]].tolist() == pytest.approx([f, p])
    assert anova.loc["Pure Error", ["sum_sq", "df"]].tolist() == pytest.approx(
        [cells.ssr, cells.df_resid]
    )


@pytest.mark.parametrize("name", [*STUDIES, "salt-2", "salt-3", "salt-4"])
def test_the_effects_of_a_screening_are_those_of_statsmodels(name):
    folder = FROZEN / name / "screening"
    runs = pd.read_csv(folder / "runs.csv").dropna(subset="response")
    fit = smf.ols("response ~ " + " + ".join(CODES), runs).fit()
    table = pd.read_csv(folder / "effects.csv").set_index("code")
    anova = pd.read_csv(folder / "anova.csv").set_index("source")
    for code in CODES:
        expected = [2 * fit.params[code], 2 * fit.bse[code], fit.pvalues[code]]
        assert table.loc[code, ["effect", "se", "p"]].tolist() == pytest.approx(expected)
        f = fit.tvalues[code] ** 2
        assert anova.loc[code, ["sum_sq", "F"]].tolist() == pytest.approx([f * fit.mse_resid, f])
    assert anova.loc["Residual", "sum_sq"] == pytest.approx(fit.ssr)
