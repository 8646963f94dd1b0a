"""Effects of two-level factors: t tests or Lenth's method, analysis of variance, and the choice of what goes on."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from calibration.errors import CalibrationError, RankDeficientError
from calibration.statistics.anova import ANOVA_COLUMNS, anova_row, finite_responses


@dataclass(frozen=True)
class Screening:
    """Effects of a two-level design. `table`: code, effect, sum_sq, contribution_percent, F, p, half_normal_score."""

    table: pd.DataFrame
    anova: pd.DataFrame
    method: str
    t_limit: float
    bonferroni_limit: float


def screen(design, codes, response, alpha=0.05):
    """Effects of two-level factors `codes` of a design table on response (n,).

    With residual degrees of freedom the effects are tested by t; a saturated design by Lenth's pseudo standard error
    (Lenth 1989, Technometrics 31:469). t_limit and bonferroni_limit are the effects whose test gives p = alpha, for
    one factor and for all of them. Raises RankDeficientError naming columns that are not orthogonal, CalibrationError
    for responses that are missing or without scatter.
    """
    x = design[codes].to_numpy(float)
    n, k = x.shape
    y = finite_responses(response, n)
    _check_orthogonal(x, codes)
    effects = 2.0 * (x.T @ y) / n
    sum_sq = n * effects**2 / 4.0
    total = float(((y - y.mean()) ** 2).sum())
    # replicates are extra degrees of freedom, like unused columns
    df = n - k - 1
    residual = max(total - float(sum_sq.sum()), 0.0)
    if df > 0:
        method, error = "residual", 2.0 * np.sqrt(residual / df / n)
    else:
        method, df = "Lenth", k / 3.0
        s0 = 1.5 * np.median(np.abs(effects))
        error = 1.5 * np.median(np.abs(effects)[np.abs(effects) < 2.5 * s0])
    if error == 0.0:
        raise CalibrationError("the screening has no scatter at all; the effects cannot be tested")
    t = np.abs(effects) / error
    order = np.argsort(np.abs(effects))
    score = np.empty(k)
    score[order] = stats.norm.ppf(0.5 + 0.5 * (np.arange(1, k + 1) - 0.5) / k)
    table = pd.DataFrame(
        {
            "code": codes,
            "effect": effects,
            "sum_sq": sum_sq,
            "contribution_percent": 100.0 * sum_sq / total,
            "t": t,
            "F": t**2,
            "p": 2.0 * stats.t.sf(t, df),
            "half_normal_score": score,
        }
    )
    return Screening(
        table,
        _screening_anova(table, residual, n - k - 1, total),
        method,
        float(stats.t.ppf(1.0 - alpha / 2, df)) * error,
        float(stats.t.ppf(1.0 - alpha / 2 / k, df)) * error,
    )


def _check_orthogonal(x, codes):
    """Effects are plain contrasts only where the columns are -1 and +1, balanced and orthogonal to each other."""
    gram = np.abs(np.column_stack([np.ones(len(x)), x]).T @ np.column_stack([np.ones(len(x)), x]))
    np.fill_diagonal(gram, 0.0)
    bad = [
        c
        for c, row, col in zip(codes, gram[1:], x.T, strict=True)
        if row.any() or (col**2 != 1).any()
    ]
    if bad:
        raise RankDeficientError(bad)


def _screening_anova(table, residual, df, total):
    k, model = len(table), float(table["sum_sq"].sum())
    mean = residual / df if df > 0 else np.nan
    f = model / k / mean if df > 0 else np.nan
    rows = [anova_row("Model", model, k, f, df)]
    rows += [
        anova_row(r.code, r.sum_sq, 1, r.sum_sq / mean, df)
        if df > 0
        else anova_row(r.code, r.sum_sq, 1, r.F, k / 3)
        for r in table.itertuples()
    ]
    if df > 0:
        rows.append(anova_row("Residual", residual, df))
    rows.append({"source": "Cor Total", "sum_sq": total, "df": k + df})
    return pd.DataFrame(rows, columns=ANOVA_COLUMNS)


def significant(screening, alpha, at_least=1, at_most=None, preferred=()):
    """Codes of the factors with p < alpha, largest effect first.

    Fewer than `at_least` are filled up, with the `preferred` codes first and then with the next largest effects; more
    than `at_most` are cut.
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
