"""Runs at several draws, some at each: what they scatter by, and how much of it is the draws'."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from calibration.errors import CalibrationError


@dataclass(frozen=True)
class Nested:
    """Mean of all, standard deviation from draw to draw, and from run to run at a draw (None where
    no draw has two). low, high: the interval that holds a further run at a further draw."""

    mean: float
    between_sd: float
    within_sd: float | None
    low: float
    high: float
    draws: int
    runs: int


def nested(values: npt.ArrayLike, of: npt.ArrayLike, level: float = 0.95) -> Nested:
    """`Nested` of values (n,) at the draws `of` (n,), by the analysis of variance of one random
    effect.

    The interval is the t interval of a further value, its degrees of freedom by Satterthwaite
    (1946, Biometrics Bulletin 2:110). Draws of unequal number count by their harmonic mean. With
    one run at each draw the two scatters are not told apart: `between_sd` then holds both. Raises
    CalibrationError for fewer than three draws.
    """
    values, of = np.asarray(values, float), np.asarray(of)
    _, which = np.unique(of, return_inverse=True)
    runs = np.bincount(which)
    n = len(runs)
    if n < 3:
        raise CalibrationError(f"{n} draws have a value; at least 3 are needed for an interval")
    means = np.bincount(which, values) / runs
    r = float(n / np.sum(1.0 / runs))
    draws = means.var(ddof=1)  # variance of a draw, and of the mean of its runs
    freedom = int(runs.sum() - n)
    within = float(((values - means[which]) ** 2).sum() / freedom) if freedom else 0.0
    rest = within * (1.0 - 1.0 / r)
    total = draws + rest
    df = n - 1.0
    if freedom and total > 0.0:
        df = total**2 / (draws**2 / (n - 1) + rest**2 / freedom)
    reach = scipy.stats.t.ppf(0.5 + 0.5 * level, df) * np.sqrt(total + draws / n)
    mean = float(means.mean())
    return Nested(
        mean,
        float(np.sqrt(max(draws - within / r, 0.0))),
        float(np.sqrt(within)) if freedom else None,
        mean - float(reach),
        mean + float(reach),
        n,
        int(runs.sum()),
    )
