"""What every analysis of variance here shares: its columns, its rows, and the check of the
responses."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from calibration.errors import CalibrationError, RankDeficientError

ANOVA_COLUMNS = ["source", "sum_sq", "df", "mean_sq", "F", "p"]


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
