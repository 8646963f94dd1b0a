"""What every analysis of variance here shares: its columns, its rows, and the check of the responses."""

import numpy as np
from scipy import stats

from calibration.errors import CalibrationError

ANOVA_COLUMNS = ["source", "sum_sq", "df", "mean_sq", "F", "p"]


def anova_row(source, sum_sq, df, f=None, df_error=None):
    """A row of the table: F and its p where `f`, on df and df_error degrees of freedom, is given and finite."""
    row = {"source": source, "sum_sq": sum_sq, "df": df, "mean_sq": sum_sq / df}
    if f is not None and np.isfinite(f):
        row |= {"F": f, "p": float(stats.f.sf(f, df, df_error))}
    return row


def finite_responses(response, runs):
    """Response (runs,) as floats. Raises CalibrationError naming the runs without a finite value."""
    y = np.asarray(response, float)
    if y.shape != (runs,):
        raise CalibrationError(f"{runs} runs need as many responses, not {y.size}")
    bad = np.flatnonzero(~np.isfinite(y)) + 1
    if bad.size:
        raise CalibrationError(f"no finite response of run {', '.join(map(str, bad))}")
    if np.ptp(y) == 0.0:
        raise CalibrationError(f"all {runs} runs have the same response {y[0]:g}")
    return y
