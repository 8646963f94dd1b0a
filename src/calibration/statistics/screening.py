"""Effects of factors: t tests or Lenth's method, analysis of variance, and the choice of what goes
on."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from calibration.errors import CalibrationError
from calibration.statistics.anova import (
    ANOVA_COLUMNS,
    anova_row,
    check_rank,
    finite_responses,
    pure_error,
)


@dataclass(frozen=True)
class Screening:
    """Effects of a design's factors. `table`: code, effect, se, sum_sq, contribution_percent, t, F,
    p, p_seeds, half_normal_score; seed_sd: what runs at one point scatter by, None where no point
    is repeated."""

    table: pd.DataFrame
    anova: pd.DataFrame
    method: str
    t_limit: float
    bonferroni_limit: float
    seed_sd: float | None = None


def screen(design, codes, response, alpha=0.05):
    """Effects of factors `codes` of a design table on response (n,): the change from -1 to +1.

    They are the main effects of a regression, so that runs may be missing, repeated or at the
    centre. With two residual degrees of freedom or more they are tested by t. With fewer they are
    tested by Lenth's pseudo standard error over all columns that n runs leave (Lenth 1989,
    Technometrics 31:469). p_seeds tests them against the scatter of repeated points alone, which
    holds no aliased interaction. t_limit and bonferroni_limit are the effects whose test gives p =
    alpha, for one factor and for all of them, at the mean standard error. Raises RankDeficientError
    naming factors that the design cannot tell apart, CalibrationError for responses that are
    missing or without scatter.
    """
    levels = design[codes].to_numpy(float)
    n, k = levels.shape
    y = finite_responses(response, n)
    x = np.column_stack([np.ones(n), levels])
    check_rank(x, ["Intercept", *codes])
    scale, beta, residual = _regression(x, y)
    df = n - k - 1
    method, df_error, sigma = _error(x, y, beta / scale, residual, df)
    if sigma == 0.0:
        raise CalibrationError("the screening has no scatter at all; the effects cannot be tested")
    seeds, df_seeds = pure_error(levels, y)
    seed_sd = float(np.sqrt(seeds / df_seeds)) if df_seeds and seeds > 0.0 else None
    total = float(((y - y.mean()) ** 2).sum())
    table = _effects(codes, beta, scale, sigma, df_error, total)
    table["p_seeds"] = np.nan
    if seed_sd:
        table["p_seeds"] = 2.0 * stats.t.sf(np.abs(beta) / (scale * seed_sd), df_seeds)
    mean_se = float(np.sqrt((table["se"] ** 2).mean()))
    return Screening(
        table,
        _screening_anova(table, float(residual @ residual), df, df_error, total),
        method,
        float(stats.t.ppf(1.0 - alpha / 2, df_error)) * mean_se,
        float(stats.t.ppf(1.0 - alpha / 2 / k, df_error)) * mean_se,
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
        return "residual", df, sigma if sigma > 1e-12 * np.abs(y).max() else 0.0
    rest = np.linalg.qr(x, mode="complete")[0][:, x.shape[1] :].T @ y
    sizes = np.abs(np.concatenate([contrasts, rest]))
    s0 = 1.5 * np.median(sizes)
    small = sizes[sizes < 2.5 * s0]
    return "Lenth", len(sizes) / 3.0, float(1.5 * np.median(small)) if len(small) else 0.0


def _effects(codes, beta, scale, sigma, df, total):
    """The table of effects without p_seeds."""
    k, effects, se = len(codes), 2.0 * beta, 2.0 * scale * sigma
    t = np.abs(effects) / se
    order = np.argsort(np.abs(effects))
    score = np.empty(k)
    score[order] = stats.norm.ppf(0.5 + 0.5 * (np.arange(1, k + 1) - 0.5) / k)
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
            "p": 2.0 * stats.t.sf(t, df),
            "half_normal_score": score,
        }
    )


def _screening_anova(table, residual, df, df_error, total):
    """Rows of the model, the factors and the residual; sums of squares are each factor's own
    share."""
    k, tested = len(table), df > 1
    model = total - residual
    f = model / k / (residual / df) if tested else np.nan
    rows = [anova_row("Model", model, k, f, df)]
    rows += [anova_row(r.code, r.sum_sq, 1, r.F, df_error) for r in table.itertuples()]
    if df > 0:
        rows.append(anova_row("Residual", residual, df))
    rows.append({"source": "Cor Total", "sum_sq": total, "df": k + df})
    return pd.DataFrame(rows, columns=ANOVA_COLUMNS)


def why(screening, codes, alpha, preferred=(), named=None):
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


def significant(screening, alpha, at_least=1, at_most=None, preferred=()):
    """Codes of the factors with p < alpha, largest effect first.

    Fewer than `at_least` are filled up, first with the `preferred` codes and then with the next
    largest effects. More than `at_most` are cut.
    """
    table = screening.table.assign(size=screening.table["effect"].abs()).sort_values(
        "size", ascending=False
    )
    chosen = list(table.loc[table["p"] < alpha, "code"])
    for code in [*(c for c in table["code"] if c in preferred), *table["code"]]:
        if len(chosen) >= at_least:
            break
        if code not in chosen:
            chosen.append(code)
    return chosen[:at_most]
