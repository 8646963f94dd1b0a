"""Quadratic response surfaces: fit, analysis of variance, diagnostics and intervals.

The tables carry what Design-Expert and R's rsm print, under the same names. Sums of squares of
terms are partial (type III in coded levels), each term's own share when all others are in the
model.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import scipy

from calibration.errors import CalibrationError, RankDeficientError
from calibration.statistics.numbers import fixed

Term = tuple[str, ...]
"""Codes of the factors whose product a term is: (), ("A",), ("A", "B"), ("A", "A")."""
ANOVA_COLUMNS = ["source", "sum_sq", "df", "mean_sq", "F", "p"]
GRID = 4001  # levels of a factor at which an interval is looked up
FLAT = 0.1
"""Of the largest eigenvalue: a curvature below it counts as none, as in R's rsm (`canonical`,
threshold)."""


def quadratic_terms(codes: Sequence[str]) -> list[Term]:
    """Terms of the full quadratic model as tuples of codes: (), (A,), (A, B), (A, A)."""
    return [(), *((c,) for c in codes), *combinations(codes, 2), *((c, c) for c in codes)]


def term_name(term: Term) -> str:
    """'A', 'AB', 'A²'; 'Intercept' for the empty term."""
    if not term:
        return "Intercept"
    return f"{term[0]}²" if len(term) == 2 and term[0] == term[1] else "".join(term)


def model_matrix(levels: npt.ArrayLike, codes: Sequence[str], terms: Sequence[Term]) -> np.ndarray:
    """(n, terms) matrix of coded levels (n, factors)."""
    levels = np.atleast_2d(np.asarray(levels, float))
    column = {c: levels[:, k] for k, c in enumerate(codes)}
    return np.column_stack(
        [np.prod([column[c] for c in t], axis=0) * np.ones(len(levels)) for t in terms]
    )


@dataclass(frozen=True)
class Surface:
    """A fitted response surface.

    coefficients: term, estimate, se, t, p, low, high, vif; anova: ANOVA_COLUMNS; summary:
    statistics by name; diagnostics: run, actual, predicted, residual, leverage, studentised
    residuals, Cook's distance.
    """

    codes: list
    terms: list
    beta: np.ndarray
    inverse: np.ndarray
    sigma2: float
    df: int
    coefficients: pd.DataFrame
    anova: pd.DataFrame
    summary: dict
    diagnostics: pd.DataFrame

    def predict(self, levels: npt.ArrayLike) -> np.ndarray:
        """Predicted response (n,) at coded levels (n, factors)."""
        return model_matrix(levels, self.codes, self.terms) @ self.beta

    def standard_error(self, levels: npt.ArrayLike) -> np.ndarray:
        """Standard error (n,) of the predicted mean."""
        x = model_matrix(levels, self.codes, self.terms)
        return np.sqrt(self.sigma2 * np.einsum("ij,jk,ik->i", x, self.inverse, x))

    def confirmation_interval(
        self, levels: npt.ArrayLike, runs: float, alpha: float = 0.05
    ) -> tuple[np.ndarray, np.ndarray]:
        """(low, high), (n,) each, for the mean of `runs` new runs at coded levels (n, factors):
        yhat +- t s sqrt(1/runs + x' (X'X)^-1 x); with runs = inf, for the true mean."""
        centre, mean_se = self.predict(levels), self.standard_error(levels)
        half = scipy.stats.t.ppf(1 - alpha / 2, self.df) * np.sqrt(self.sigma2 / runs + mean_se**2)
        return centre - half, centre + half

    def canonical(self) -> dict[str, Any]:
        """Stationary point (factors,) in coded levels, eigenvalues (factors,), axes (factors,
        factors) as columns, and kind: maximum, minimum, saddle, `ridge` if an eigenvalue is below
        FLAT of the largest, `plane` if nothing is curved. Along flat axes the point is the nearest
        to the centre: its position there says nothing."""
        linear, quadratic = self._gradient_and_hessian()
        values, axes = np.linalg.eigh(quadratic)
        largest = np.abs(values).max()
        flat = np.abs(values) < FLAT * largest
        slope = axes.T @ linear
        if largest <= 1e-9 * np.abs(linear).max(initial=1e-300):
            kind, flat = "plane", np.ones(len(values), bool)
        elif flat.any():
            kind = "ridge"
        else:
            kind = (
                "maximum" if (values < 0).all() else "minimum" if (values > 0).all() else "saddle"
            )
        safe = np.where(flat, 1.0, values)
        point = axes @ np.where(flat, 0.0, -0.5 * slope / safe)
        return {
            "point": point,
            "response": float(self.predict([point])[0]),
            "eigenvalues": values,
            "axes": axes,
            "kind": kind,
        }

    def _gradient_and_hessian(self):
        k = len(self.codes)
        linear, quadratic = np.zeros(k), np.zeros((k, k))
        for term, b in zip(self.terms, self.beta, strict=True):
            i = [self.codes.index(c) for c in term]
            if len(i) == 1:
                linear[i[0]] += b
            elif len(i) == 2:
                quadratic[i[0], i[1]] += b / 2
                quadratic[i[1], i[0]] += b / 2
        return linear, quadratic

    def equation(self) -> str:
        """The model as text in coded levels."""
        text = fixed(self.beta[0], 2)
        for t, b in zip(self.terms[1:], self.beta[1:], strict=True):
            text += f" {'+' if b >= 0 else '−'} {abs(b):.2f} {term_name(t)}"
        return text


def fit_surface(
    design: pd.DataFrame,
    codes: Sequence[str],
    response: npt.ArrayLike,
    terms: Sequence[Term] | None = None,
) -> Surface:
    """Fit the full quadratic model, or the given terms, to a design table's coded columns.

    Raises RankDeficientError naming the terms that the design cannot tell apart, CalibrationError
    when no degree of freedom is left.
    """
    terms = list(terms or quadratic_terms(codes))
    levels = design[codes].to_numpy(float)
    x = model_matrix(levels, codes, terms)
    n, p = x.shape
    y = finite_responses(response, n)
    check_rank(x, [term_name(t) for t in terms])
    if n <= p:
        raise CalibrationError(f"{n} runs leave no degree of freedom for a model of {p} terms")
    inverse = np.linalg.inv(x.T @ x)
    beta = inverse @ (x.T @ y)
    predicted = x @ beta
    residual = y - predicted
    df, sse = n - p, float(residual @ residual)
    if sse == 0.0:
        raise CalibrationError(
            "the responses follow the model exactly: nothing scatters, so nothing can be tested or "
            "bounded"
        )
    sigma2 = sse / df
    leverage = np.einsum("ij,jk,ik->i", x, inverse, x)
    anova, lack = _anova(terms, beta, inverse, y, sse, df, levels)
    free = (
        1.0 - leverage > 1e-9
    )  # a run that alone decides a coefficient cannot be predicted without itself
    press = float(((residual / (1.0 - leverage)) ** 2).sum()) if free.all() else np.nan
    total = float(((y - y.mean()) ** 2).sum())
    summary = {
        "R2": 1.0 - sse / total,
        "R2_adj": 1.0 - sigma2 / (total / (n - 1)),
        "R2_pred": 1.0 - press / total,
        "PRESS": press,
        "sd": float(np.sqrt(sigma2)),
        "mean": float(y.mean()),
        "CV_percent": 100.0 * float(np.sqrt(sigma2)) / float(y.mean()),
        "adequate_precision": float(np.ptp(predicted) / np.sqrt(p * sigma2 / n)),
        "lack_of_fit_p": lack,
    }
    return Surface(
        list(codes), terms, beta, inverse, sigma2, df,
        _coefficients(terms, beta, inverse, sigma2, df, x),
        anova, summary, _diagnostics(y, predicted, residual, leverage, sigma2, p, df),
    )  # fmt: skip


def outlier_limit(surface: Surface, alpha: float = 0.05) -> float:
    """Externally studentised residual that the largest of all runs exceeds by chance in a share
    alpha of cases, by Bonferroni (Cook and Weisberg 1982, Residuals and Influence in Regression,
    2.2.2); NaN without the freedom."""
    free = int(surface.diagnostics["externally_studentised"].notna().sum())
    if surface.df < 2 or not free:
        return np.nan
    return float(scipy.stats.t.ppf(1.0 - alpha / 2.0 / free, surface.df - 1))


def outliers(surface: Surface, alpha: float = 0.05) -> np.ndarray:
    """Positions of the runs whose residual lies beyond `outlier_limit`."""
    size = surface.diagnostics["externally_studentised"].abs().to_numpy()
    with np.errstate(invalid="ignore"):
        return np.flatnonzero(size > outlier_limit(surface, alpha))


def reduced_surface(design: pd.DataFrame, codes: Sequence[str], response: npt.ArrayLike) -> Surface:
    """The surface without the terms that say nothing: backward elimination by hierarchy.

    The term with the largest p is removed as long as this p is at least 0.1. A factor stays as
    long as a term that holds it stays (Peixoto 1990, American Statistician 44:26). So the model
    does not depend on how the levels are coded.
    """
    terms = quadratic_terms(codes)
    while True:
        surface = fit_surface(design, codes, response, terms)
        p = dict(zip(terms, surface.coefficients["p"], strict=True))
        free = [t for t in terms if t and not any(set(t) < set(o) or t * 2 == o for o in terms)]
        worst = max(free, key=lambda term: p[term], default=None)
        if worst is None or p[worst] < 0.1 or len(terms) == 2:
            return surface
        terms = [t for t in terms if t != worst]


def parameter_interval(
    surface: Surface,
    target: float,
    point: Sequence[float] | np.ndarray,
    k: int,
    alpha: float = 0.05,
    target_se: float = 0.0,
    target_df: float = np.inf,
) -> tuple[float, float]:
    """(low, high) in coded levels of factor k around the optimum `point` (factors,), the others
    held.

    The levels around the point at which the surface's mean may be the target. The target is itself
    a mean with the standard error `target_se` on `target_df` degrees of freedom. This is an inverse
    prediction (Fieller 1954). The degrees of freedom of the two errors together are by
    Satterthwaite (1946). An end at -1 or +1 is the border of the region: the data do not bound the
    factor there. What the other factors leave open is the posterior's to say.
    """
    grid = np.linspace(-1.0, 1.0, GRID)
    levels = np.tile(np.asarray(point, float), (GRID, 1))
    levels[:, k] = grid
    own, other = surface.standard_error(levels) ** 2, target_se**2
    df = (own + other) ** 2 / (own**2 / surface.df + other**2 / target_df)
    reach = scipy.stats.t.ppf(1 - alpha / 2, df) * np.sqrt(own + other)
    inside = np.abs(surface.predict(levels) - target) <= reach
    start = int(np.argmin(np.abs(grid - point[k])))
    if not inside[start]:
        return float(point[k]), float(point[k])
    out = np.flatnonzero(~inside)
    below, above = out[out < start], out[out > start]
    low = below[-1] + 1 if len(below) else 0
    high = above[0] - 1 if len(above) else GRID - 1
    return float(grid[low]), float(grid[high])


def _anova(terms, beta, inverse, y, sse, df, levels):
    total = float(((y - y.mean()) ** 2).sum())
    mean, k = sse / df, len(terms) - 1
    rows = [anova_row("Model", total - sse, k, (total - sse) / k / mean, df)]
    for i, term in enumerate(terms):
        if term:
            sum_sq = float(beta[i] ** 2 / inverse[i, i])
            rows.append(anova_row(term_name(term), sum_sq, 1, sum_sq / mean, df))
    rows.append(anova_row("Residual", sse, df))
    pure, df_pure = pure_error(levels, y)
    lack_p = np.nan
    if 0 < df_pure < df and pure > 0.0:
        lack, df_lack = sse - pure, df - df_pure
        f = lack / df_lack / (pure / df_pure)
        rows += [
            anova_row("Lack of Fit", lack, df_lack, f, df_pure),
            anova_row("Pure Error", pure, df_pure),
        ]
        lack_p = rows[-2]["p"]
    rows.append({"source": "Cor Total", "sum_sq": total, "df": len(y) - 1})
    return pd.DataFrame(rows, columns=ANOVA_COLUMNS), lack_p


def _coefficients(terms, beta, inverse, sigma2, df, x):
    se = np.sqrt(sigma2 * np.diag(inverse))
    half = scipy.stats.t.ppf(0.975, df) * se
    spread = ((x - x.mean(0)) ** 2).sum(0)
    return pd.DataFrame(
        {
            "term": [term_name(t) for t in terms],
            "estimate": beta,
            "se": se,
            "t": beta / se,
            "p": 2 * scipy.stats.t.sf(np.abs(beta / se), df),
            "low": beta - half,
            "high": beta + half,
            "vif": np.where(spread > 0, np.diag(inverse) * spread, np.nan),
        }
    )


def _diagnostics(y, predicted, residual, leverage, sigma2, p, df):
    free = 1.0 - leverage > 1e-9
    internal = np.full_like(residual, np.nan)
    internal[free] = residual[free] / np.sqrt(sigma2 * (1.0 - leverage[free]))
    # the variance without the run itself; a run that fits exactly leaves the internal value
    outside = (df - internal**2) / (df - 1) if df > 1 else np.ones_like(internal)
    cooks = np.full_like(internal, np.nan)
    cooks[free] = internal[free] ** 2 * leverage[free] / (1.0 - leverage[free]) / p
    return pd.DataFrame(
        {
            "run": np.arange(1, len(y) + 1),
            "actual": y,
            "predicted": predicted,
            "residual": residual,
            "leverage": leverage,
            "studentised": internal,
            "externally_studentised": internal / np.sqrt(np.maximum(outside, 1e-12)),
            "cooks_distance": cooks,
        }
    )


def anova_row(
    source: str, sum_sq: float, df: float, f: float | None = None, df_error: float | None = None
) -> dict[str, Any]:
    """A row of the table: F and its p where `f`, on df and df_error degrees of freedom, is given
    and finite."""
    row = {"source": source, "sum_sq": sum_sq, "df": df, "mean_sq": sum_sq / df}
    if f is not None and np.isfinite(f):
        row |= {"F": f, "p": float(scipy.stats.f.sf(f, df, df_error))}
    return row


def finite_responses(response: npt.ArrayLike, runs: int) -> np.ndarray:
    """Response (runs,) as floats. Raises CalibrationError naming the runs without a finite
    value."""
    y = np.asarray(response, float)
    if y.shape != (runs,):
        raise CalibrationError(f"{runs} runs need as many responses, not {y.size}")
    bad = np.flatnonzero(~np.isfinite(y)) + 1
    if bad.size:
        raise CalibrationError(f"no finite response of run {', '.join(map(str, bad))}")
    if np.ptp(y) == 0.0:
        raise CalibrationError(f"all {runs} runs have the same response {y[0]:g}")
    return y


def check_rank(x: np.ndarray, names: Sequence[str]) -> None:
    """Raises RankDeficientError with those `names` of the columns of x (n, p) that it cannot tell
    apart."""
    rank = np.linalg.matrix_rank(x)
    if rank == x.shape[1]:
        return
    null = np.abs(np.linalg.svd(x)[2][rank:])
    raise RankDeficientError(
        [name for name, involved in zip(names, (null > 1e-8).any(0), strict=True) if involved]
    )


def pure_error(levels: np.ndarray, y: np.ndarray) -> tuple[float, int]:
    """Sum of squares within groups of equal points (n, factors) and its degrees of freedom."""
    _, group = np.unique(np.round(levels, 9), axis=0, return_inverse=True)
    group = group.ravel()
    within = sum(
        float(((y[group == g] - y[group == g].mean()) ** 2).sum()) for g in np.unique(group)
    )
    return within, len(y) - len(np.unique(group))
