"""Effects of factors: t tests or Lenth's method, analysis of variance, what is aliased with an
effect, and the choice of what goes on."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pandas as pd
import scipy

from calibration.errors import CalibrationError
from calibration.statistics.surface import (
    ANOVA_COLUMNS,
    anova_row,
    check_rank,
    finite_responses,
    pure_error,
)
from calibration.statistics.ties import largest_first


@dataclass(frozen=True)
class Screening:
    """Effects of a design's factors.

    `table`: code, effect, se, sum_sq, contribution_percent, t, F, p, p_seeds, half_normal_score,
    vif; method: what the effects are judged against, `pure error`, `residual` or `Lenth`; seed_sd:
    what runs at one point scatter by, None where no point is repeated."""

    table: pd.DataFrame
    anova: pd.DataFrame
    method: str
    t_limit: float
    bonferroni_limit: float
    seed_sd: float | None = None


PURE_ERROR, RESIDUAL, LENTH = "pure error", "residual", "Lenth"
LEAST_PURE = 3
"""Degrees of freedom from which on the scatter of repeated points judges the effects: on two, a
t test at 0.05 asks for more than four standard errors."""


def screen(
    design: pd.DataFrame, codes: Sequence[str], response: npt.ArrayLike, alpha: float = 0.05
) -> Screening:
    """Effects of factors `codes` of a design table on response (n,): the change from -1 to +1.

    They are the main effects of a regression, so that runs may be missing, repeated or at the
    centre. Where points are repeated (`LEAST_PURE` degrees of freedom or more), t tests judge them
    by the scatter between the repeats, the pure error: the residual holds the interactions too that
    the model leaves out (Montgomery 2017, Design and Analysis of Experiments, 6.8 and 11.3). Else
    the residual judges them, on two degrees of freedom or more, or Lenth's pseudo standard error
    over all columns that n runs leave (Lenth 1989, Technometrics 31:469). p_seeds tests them
    against the scatter of repeated points wherever there is one. vif: variance inflation, 1 for
    orthogonal columns. t_limit and bonferroni_limit are the effects whose test gives p = alpha, for
    one factor and for all of them, at the mean standard error. Raises RankDeficientError naming
    factors that the design cannot tell apart, CalibrationError for responses that are missing or
    without scatter.
    """
    levels = design[codes].to_numpy(float)
    n, k = levels.shape
    y = finite_responses(response, n)
    x = np.column_stack([np.ones(n), levels])
    check_rank(x, ["Intercept", *codes])
    scale, beta, residual = _regression(x, y)
    df = n - k - 1
    seeds, df_seeds = pure_error(levels, y)
    seed_sd = float(np.sqrt(seeds / df_seeds)) if df_seeds and seeds > 0.0 else None
    method, df_error, sigma = _error(x, y, beta / scale, residual, df)
    if seed_sd and df_seeds >= LEAST_PURE:
        method, df_error, sigma = PURE_ERROR, df_seeds, seed_sd
    if sigma == 0.0:
        raise CalibrationError("the screening has no scatter at all; the effects cannot be tested")
    total = float(((y - y.mean()) ** 2).sum())
    table = _effects(codes, beta, scale, sigma, df_error, total)
    table["vif"] = scale**2 * ((levels - levels.mean(axis=0)) ** 2).sum(axis=0)
    table["p_seeds"] = np.nan
    if seed_sd:
        table["p_seeds"] = 2.0 * scipy.stats.t.sf(np.abs(beta) / (scale * seed_sd), df_seeds)
    mean_se = float(np.sqrt((table["se"] ** 2).mean()))
    return Screening(
        table,
        _screening_anova(
            table, residual @ residual, df, (sigma, df_error), total, (seeds, df_seeds)
        ),
        method,
        float(scipy.stats.t.ppf(1.0 - alpha / 2, df_error)) * mean_se,
        float(scipy.stats.t.ppf(1.0 - alpha / 2 / k, df_error)) * mean_se,
        seed_sd,
    )


def _regression(x, y):
    """Of the factors' columns: standard errors (k,) in units of the error, slopes (k,); and the
    residuals (n,)."""
    inverse = np.linalg.inv(x.T @ x)
    beta = inverse @ (x.T @ y)
    return np.sqrt(np.diag(inverse))[1:], beta[1:], y - x @ beta


def _error(x, y, contrasts, residual, df):
    """(method, degrees of freedom, standard deviation) of the error behind contrasts (k,) of unit
    variance.

    At most one residual degree of freedom says nothing of itself; it then counts as one more column
    for Lenth.
    """
    if df > 1:
        # replicates are extra degrees of freedom, like unused columns
        sigma = float(np.sqrt(residual @ residual / df))
        return RESIDUAL, df, sigma if sigma > 1e-12 * np.abs(y).max() else 0.0
    rest = np.linalg.qr(x, mode="complete")[0][:, x.shape[1] :].T @ y
    sizes = np.abs(np.concatenate([contrasts, rest]))
    s0 = 1.5 * np.median(sizes)
    small = sizes[sizes < 2.5 * s0]
    return LENTH, len(sizes) / 3.0, float(1.5 * np.median(small)) if len(small) else 0.0


def _effects(codes, beta, scale, sigma, df, total):
    """The table of effects without p_seeds."""
    k, effects, se = len(codes), 2.0 * beta, 2.0 * scale * sigma
    t = np.abs(effects) / se
    order = largest_first(-np.abs(effects))
    score = np.empty(k)
    score[order] = scipy.stats.norm.ppf(0.5 + 0.5 * (np.arange(1, k + 1) - 0.5) / k)
    sum_sq = (beta / scale) ** 2
    return pd.DataFrame(
        {
            "code": codes,
            "effect": effects,
            "se": se,
            "sum_sq": sum_sq,
            "contribution_percent": 100.0 * sum_sq / total,
            "t": t,
            "F": t**2,
            "p": 2.0 * scipy.stats.t.sf(t, df),
            "half_normal_score": score,
        }
    )


def _screening_anova(table, residual, df, error, total, pure):
    """Rows of the model, the factors and the residual; sums of squares are each factor's own share.
    error: (standard deviation, degrees of freedom) that all are judged by; pure: (sum of squares,
    degrees of freedom) within repeated points, which part the residual from the lack of fit."""
    k, (sigma, df_error), (seeds, df_seeds) = len(table), error, pure
    residual = float(residual)
    model = total - residual
    rows = [anova_row("Model", model, k, model / k / sigma**2 if df > 1 else None, df_error)]
    rows += [anova_row(r.code, r.sum_sq, 1, r.F, df_error) for r in table.itertuples()]
    if df > 0:
        rows.append(anova_row("Residual", residual, df))
    lack, df_lack = residual - seeds, df - df_seeds
    if df_seeds > 0 and df_lack > 0:
        f = lack / df_lack / (seeds / df_seeds) if seeds > 0.0 else None
        rows.append(anova_row("Lack of Fit", lack, df_lack, f, df_seeds))
    if df_seeds > 0:
        rows.append(anova_row("Pure Error", seeds, df_seeds))
    rows.append({"source": "Cor Total", "sum_sq": total, "df": k + df})
    return pd.DataFrame(rows, columns=ANOVA_COLUMNS)


LEAST_ALIAS = 0.05
"""Share of an interaction from which on an effect is said to carry it: a lost run leaves hundredths
everywhere."""


def aliases(levels: np.ndarray, codes: Sequence[str]) -> dict[str, dict[str, float]]:
    """{code: {pair: share}} of the two-factor interactions that a main effect carries.

    levels : (n, factors) coded; share : how much an interaction of size 1 adds to the effect, which
        is the alias matrix (X'X)^-1 X'Z of the main effects' model X and the interactions Z (Box
        and Draper 2007, Response Surfaces, Mixtures, and Ridge Analyses, 3.10)
    In a design of resolution IV there are none; in one of twelve Plackett-Burman runs each effect
    carries a third of all interactions of the other factors. Shares below `LEAST_ALIAS` are left
    out.
    """
    levels = np.asarray(levels, float)
    pairs = list(combinations(range(len(codes)), 2))
    if not pairs:
        return {}
    x = np.column_stack([np.ones(len(levels)), levels])
    z = np.column_stack([levels[:, i] * levels[:, j] for i, j in pairs])
    shares = np.linalg.lstsq(x, z, rcond=None)[0][1:]
    return {
        code: {
            codes[i] + codes[j]: float(share)
            for (i, j), share in zip(pairs, row, strict=True)
            if abs(share) >= LEAST_ALIAS
        }
        for code, row in zip(codes, shares, strict=True)
    }


def interactions(
    design: pd.DataFrame, codes: Sequence[str], response: npt.ArrayLike
) -> pd.DataFrame | None:
    """Table: pair, sum_sq, share, F, p: what each two-factor interaction alone takes of the lack of
    fit, the largest first; None where no point is repeated or nothing is left to explain.

    share : of the sum of squares of the lack of fit; F, p : against the pure error
    Interactions that the runs do not tell apart have the same sum of squares, and one of them at
    most is real.
    """
    levels = design[codes].to_numpy(float)
    y = finite_responses(response, len(levels))
    x = np.column_stack([np.ones(len(y)), levels])
    seeds, df_seeds = pure_error(levels, y)
    residual = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    lack, df_lack = float(residual @ residual) - seeds, len(y) - x.shape[1] - df_seeds
    if df_seeds < 1 or df_lack < 1 or seeds <= 0.0 or len(codes) < 2:
        return None
    rows = []
    for i, j in combinations(range(len(codes)), 2):
        column = levels[:, i] * levels[:, j]
        own = column - x @ np.linalg.lstsq(x, column, rcond=None)[0]
        size = float(own @ own)
        taken = float(own @ y) ** 2 / size if size > 1e-9 * len(y) else 0.0
        f = taken / (seeds / df_seeds)
        row = {"pair": codes[i] + codes[j], "sum_sq": taken, "share": taken / lack, "F": f}
        rows.append(row | {"p": float(scipy.stats.f.sf(f, 1, df_seeds))})
    table = pd.DataFrame(rows)
    return table.iloc[largest_first(table["sum_sq"])].reset_index(drop=True)


def why(
    screening: Screening,
    codes: Sequence[str],
    alpha: float,
    preferred: Collection[str] = (),
    named: Sequence[str] | None = None,
) -> dict[str, str]:
    """Why each of `codes` goes on, {code: words}: it is significant, or the configuration names it,
    on its path (`preferred`) or outright (`named`), or its effect is the next largest."""
    p = screening.table.set_index("code")["p"]

    def reason(code):
        if named:
            return "named by screening.go_on"
        if p[code] < alpha:
            return "significant"
        return "named by the configured path" if code in preferred else "next largest effect"

    return {code: reason(code) for code in codes}


def significant(
    screening: Screening,
    alpha: float,
    at_least: int = 1,
    at_most: int | None = None,
    preferred: Collection[str] = (),
) -> list[str]:
    """Codes of the factors with p < alpha, largest effect first; of equal ones the first code.

    Fewer than `at_least` are filled up, first with the `preferred` codes and then with the next
    largest effects. More than `at_most` are cut.
    """
    table = screening.table.iloc[largest_first(screening.table["effect"].abs())]
    chosen = list(table.loc[table["p"] < alpha, "code"])
    for code in [*(c for c in table["code"] if c in preferred), *table["code"]]:
        if len(chosen) >= at_least:
            break
        if code not in chosen:
            chosen.append(code)
    return chosen[:at_most]
