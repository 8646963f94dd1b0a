"""The analysis agrees with published examples, to the digits that are printed, and with fits of
the same models by statsmodels.

Data and printed results of the eye focus time and of the rising ridge were compared with their
sources when they were entered: R's package rsm 2.10.6 (the example of `rsm`); worked notes on
Montgomery's chapter 8 that print both fractions and all effects of example 8.7, and three
independent transcriptions of the first fraction's data.
"""

import itertools

import numpy as np
import pandas as pd
import pyDOE3
import pytest
import statsmodels.formula.api as smf
from scipy import stats
from statsmodels.stats.anova import anova_lm
from statsmodels.stats.outliers_influence import OLSInfluence, variance_inflation_factor

from calibration.errors import RankDeficientError
from calibration.stages.screening import aliasing
from calibration.statistics.design import box_behnken, foldover, plackett_burman
from calibration.statistics.screening import screen, significant
from calibration.statistics.surface import fit_surface
from frozen import FROZEN
from made_up import factors
from paper_tables import paper_table

# Montgomery, Design and Analysis of Experiments, 8th edition, table 6.10: filtration rates of an
# unreplicated 2^4
FILTRATION = [45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96]


def filtration():
    signs = {c: np.where(np.arange(16) & (1 << i), 1.0, -1.0) for i, c in enumerate("ABCD")}
    columns = {}
    for subset in range(1, 16):
        letters = [c for i, c in enumerate("ABCD") if subset & (1 << i)]
        columns["".join(letters)] = np.prod([signs[c] for c in letters], axis=0)
    return pd.DataFrame(columns)


def test_lenths_method_on_the_filtration_rates():
    design = filtration()
    result = screen(design, list(design), FILTRATION)
    effects = result.table.set_index("code")["effect"]
    # the effects of table 6.12 and the margin of error 2.571 x 2.625 printed with them
    for code, value in {"A": 21.625, "C": 9.875, "D": 14.625, "AC": -18.125, "AD": 16.625}.items():
        assert effects[code] == pytest.approx(value)
    assert result.method == "Lenth"
    assert result.t_limit == pytest.approx(6.748, abs=0.001)
    assert significant(result, 0.05) == ["A", "AC", "AD", "D", "C"]


@pytest.mark.parametrize("alpha", [0.01, 0.1])
def test_the_limits_are_the_effects_at_which_p_is_alpha(alpha):
    design, codes = plackett_burman(factors(7)), list("ABCDEFG")
    response = 10 + design["A"] + np.random.default_rng(1).normal(size=12)
    result = screen(design, codes, response, alpha=alpha)
    table = result.table
    p = dict(zip(table["code"], table["p"], strict=True))
    beyond = set(table.loc[table["effect"].abs() > result.t_limit, "code"])
    assert beyond == {c for c in codes if p[c] < alpha}
    beyond = set(table.loc[table["effect"].abs() > result.bonferroni_limit, "code"])
    assert beyond == {c for c in codes if p[c] < alpha / 7}


def test_too_few_significant_factors_are_filled_up_and_too_many_are_cut():
    design = plackett_burman(factors(7))
    noise = 0.4 * np.random.default_rng(5).normal(size=12)
    response = 10 + 3 * design["D"] + 0.4 * design["B"] + noise
    result = screen(design, list("ABCDEFG"), response)
    sizes = result.table.set_index("code")["effect"].abs().sort_values(ascending=False)
    assert significant(result, 1e-3) == ["D"]
    assert significant(result, 1e-3, at_least=3) == list(sizes.index[:3])
    assert significant(result, 1e-3, at_least=2, preferred=["G"]) == ["D", "G"]
    assert significant(result, 0.999, at_most=2) == list(sizes.index[:2])


# Montgomery, table 11.6: yield of a chemical process, central composite design in two factors
YIELD = [76.5, 77.0, 78.0, 79.5, 79.9, 80.3, 80.0, 79.7, 79.8, 78.4, 75.6, 78.5, 77.0]


def central_composite():
    s = 1.414
    points = [(-1, -1), (-1, 1), (1, -1), (1, 1), *[(0, 0)] * 5, (s, 0), (-s, 0), (0, s), (0, -s)]
    return pd.DataFrame(points, columns=["A", "B"], dtype=float)


def test_the_yield_of_montgomerys_chemical_process():
    surface = fit_surface(central_composite(), ["A", "B"], YIELD)
    printed = {"Intercept": 79.94, "A": 0.99, "B": 0.52, "AB": 0.25, "A²": -1.38, "B²": -1.00}
    estimates = surface.coefficients.set_index("term")["estimate"]
    for term, value in printed.items():
        assert estimates[term] == pytest.approx(value, abs=0.0051), term
    stationary = surface.canonical()
    assert stationary["kind"] == "maximum"
    assert stationary["point"] == pytest.approx([0.389, 0.306], abs=0.001)
    assert stationary["response"] == pytest.approx(80.21, abs=0.005)
    assert sorted(stationary["eigenvalues"]) == pytest.approx([-1.4143, -0.9635], abs=0.001)


def peer(design, response, codes="ABC"):
    """The same quadratic model in statsmodels."""
    linear, squares = "+".join(codes), "+".join(f"I({c}**2)" for c in codes)
    formula = f"y ~ ({linear})**2 + {squares}"
    return smf.ols(formula, design.assign(y=np.asarray(response))).fit()


def noisy_surface(seed=4):
    design = box_behnken(factors(3), centre_runs=4)
    a, b, c = (design[x] for x in "ABC")
    noise = np.random.default_rng(seed).normal(scale=0.5, size=len(design))
    return design, 40 + 2 * a - b + 0.5 * c + a * b + 1.5 * a**2 - c**2 + noise


def test_the_diagnostics_agree_with_statsmodels():
    design, response = noisy_surface()
    ours = fit_surface(design, list("ABC"), response)
    theirs = OLSInfluence(peer(design, response))
    d = ours.diagnostics
    assert d["leverage"].to_numpy() == pytest.approx(theirs.hat_matrix_diag)
    assert d["studentised"].to_numpy() == pytest.approx(theirs.resid_studentized_internal)
    assert d["externally_studentised"].to_numpy() == pytest.approx(
        theirs.resid_studentized_external
    )
    assert d["cooks_distance"].to_numpy() == pytest.approx(theirs.cooks_distance[0])
    assert ours.summary["PRESS"] == pytest.approx(theirs.ess_press)


def test_the_summary_and_the_analysis_of_variance_agree_with_statsmodels():
    design, response = noisy_surface()
    ours, fit = fit_surface(design, list("ABC"), response), peer(design, response)
    said, anova = ours.summary, ours.anova.set_index("source")
    spread, fitted = np.sqrt(fit.mse_resid), fit.fittedvalues
    assert (said["R2"], said["R2_adj"]) == pytest.approx((fit.rsquared, fit.rsquared_adj))
    assert said["R2_pred"] == pytest.approx(1.0 - said["PRESS"] / fit.centered_tss)
    assert said["CV_percent"] == pytest.approx(100.0 * spread / response.mean())
    # adequate precision: the range of the fitted values over their mean standard error
    error = spread * np.sqrt(10 / len(design))
    assert said["adequate_precision"] == pytest.approx(np.ptp(fitted) / error)
    model = anova.loc["Model", ["sum_sq", "df", "F", "p"]].tolist()
    assert model == pytest.approx([fit.ess, fit.df_model, fit.fvalue, fit.f_pvalue])
    for term in ("A", "AB", "A²"):
        name = {"AB": "A:B", "A²": "I(A ** 2)"}.get(term, term)
        f, own = fit.tvalues[name] ** 2, ours.coefficients.set_index("term").loc[term]
        assert own[["estimate", "se"]].tolist() == pytest.approx([fit.params[name], fit.bse[name]])
        row = anova.loc[term, ["sum_sq", "F", "p"]].tolist()
        assert row == pytest.approx([f * fit.mse_resid, f, fit.pvalues[name]])
    cell = design[list("ABC")].astype(str).agg(" ".join, axis=1)  # a mean for each point
    cells = smf.ols("y ~ cell", pd.DataFrame({"y": response, "cell": cell})).fit()
    lack = anova_lm(fit, cells).iloc[1][["ss_diff", "df_diff", "F", "Pr(>F)"]]
    row = anova.loc["Lack of Fit", ["sum_sq", "df", "F", "p"]].tolist()
    assert row == pytest.approx(lack.tolist())


def test_runs_count_as_replicates_only_where_all_factors_agree():
    # without a term in C, points that differ in C have equal rows in the model, yet are no
    # replicates
    design, response = noisy_surface()
    surface = fit_surface(design, list("ABC"), response, terms=[(), ("A",), ("B",)])
    assert surface.anova.set_index("source").loc["Pure Error", "df"] == 3


def test_intervals_agree_with_statsmodels():
    design, response = noisy_surface()
    ours, theirs = fit_surface(design, list("ABC"), response), peer(design, response)
    at = pd.DataFrame([[0.3, -0.5, 0.8], [0.0, 0.0, 0.0]], columns=list("ABC"))
    frame = theirs.get_prediction(at).summary_frame(alpha=0.1)
    mean = np.transpose(ours.confirmation_interval(at, np.inf, alpha=0.1))
    assert mean == pytest.approx(frame[["mean_ci_lower", "mean_ci_upper"]].to_numpy())
    single = np.transpose(ours.confirmation_interval(at, 1, alpha=0.1))
    assert single == pytest.approx(frame[["obs_ci_lower", "obs_ci_upper"]].to_numpy())


def test_aliased_terms_are_named():
    design = plackett_burman(factors(3))
    with pytest.raises(RankDeficientError) as error:
        fit_surface(design, list("ABC"), np.arange(12.0))
    # in two levels all squares are the intercept
    assert {"Intercept", "A²", "B²", "C²"} == set(error.value.terms)


def test_a_run_that_alone_decides_a_coefficient_has_no_press():
    design = pd.DataFrame({"A": [-1.0, -1.0, -1.0, 1.0]})
    surface = fit_surface(design, ["A"], [1.0, 2.0, 1.5, 9.0], terms=[(), ("A",)])
    assert np.isnan(surface.summary["R2_pred"])
    assert surface.diagnostics["studentised"].isna().tolist() == [False, False, False, True]


def test_the_twelve_runs_are_those_that_manuals_print():
    """Eleven turns of one row and a row of high levels, as Altair's HyperStudy manual prints them
    (Plackett Burman, 2021) and, by memory alone, NIST's handbook 5.3.3.5."""
    ours = plackett_burman(factors(11))[[f.code for f in factors(11)]].to_numpy()
    row = np.array([-1, 1, -1, 1, 1, 1, -1, -1, -1, 1, -1])
    printed = np.vstack([np.ones(11), *[np.roll(row, k) for k in range(11)]])
    assert {tuple(row) for row in ours} == {tuple(row) for row in printed}


def test_the_foldover_of_the_eye_focus_time():
    """Montgomery, Design and Analysis of Experiments, 8th edition, example 8.7: the 2^(7-4) design
    of resolution III with D = AB, E = AC, F = BC, G = ABC, its foldover, and the effects of each
    half and of both."""
    runs = pyDOE3.fracfact("a b c ab ac bc abc")
    runs = runs[np.lexsort(runs[:, :3].T)]  # as they are printed: the first factor changes first
    three = pd.DataFrame(runs, columns=list("ABCDEFG"))
    first = [85.5, 75.1, 93.2, 145.4, 83.7, 77.6, 95.0, 141.8]
    second = [91.3, 136.7, 82.4, 73.4, 94.1, 143.8, 87.3, 71.9]
    both = foldover(three, factors(7))
    printed = {
        1: [20.63, 38.38, -0.28, 28.88, -0.28, -0.63, -2.43],
        2: [-17.68, 37.73, -3.33, 29.88, 0.53, 1.63, 2.68],
        0: [1.48, 38.05, -1.80, 29.38, 0.13, 0.50, 0.13],
    }
    assert list(both["run"]) == list(range(1, 17))
    assert both["f0"].to_numpy() == pytest.approx(0.5 + 0.5 * both["A"].to_numpy())
    both["y"] = first + second
    for fold, effects in printed.items():
        here = both[both["fold"] == fold] if fold else both
        found = screen(here, list("ABCDEFG"), here["y"]).table["effect"]
        assert found.to_numpy() == pytest.approx(effects, abs=0.0051)


def test_a_rising_ridge_is_told():
    """Myers, Montgomery and Anderson-Cook, table 6.2 (the example `RRex` of R's rsm), a rising
    ridge: without the flat axis the stationary point lies inside the experiment, with it twice as
    far out as any run."""
    points = [(-1, -1), (1, -1), (-1, 1), (1, 1), (-1, 0), (1, 0), (0, -1), (0, 1), *[(0, 0)] * 3]
    design = pd.DataFrame(points, columns=["A", "B"], dtype=float)
    y = [52.3, 5.3, 46.7, 44.2, 58.5, 33.5, 32.8, 49.2, 49.3, 50.2, 51.6]
    surface = fit_surface(design, ["A", "B"], y)
    found = surface.canonical()
    assert found["kind"] == "ridge"
    assert np.abs(found["point"]).max() < 1.0
    linear, quadratic = surface.coefficients["estimate"].to_numpy()[[1, 2]], found["axes"]
    full = quadratic @ (-0.5 * (quadratic.T @ linear) / found["eigenvalues"])
    assert np.linalg.norm(full) > 2.0 * np.sqrt(2.0)


CODES = list("ABCDEFG")


@pytest.fixture(scope="module")
def runs():
    """The screening of four frozen studies that differ by their seeds."""
    names = ("salt", "salt-2", "salt-3", "salt-4")
    tables = [pd.read_csv(FROZEN / n / "screening/runs.csv") for n in names]
    table = pd.concat(tables, ignore_index=True).dropna(subset="response")
    return table.assign(cell="row " + table["run"].astype(str))


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
    table = paper_table("table06_plackett_burman")
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
