"""Three verdicts on a difference, by a margin that was stated before the data were seen.

`equivalent` and `different` are both proven, each at level alpha. If neither is proven, the verdict
is `undecided`, and more runs decide. Scatter therefore earns no verdict, and a small difference
known exactly is equivalent.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from calibration.errors import CalibrationError

ALPHA = 0.05
EQUIVALENT, DIFFERENT, UNDECIDED = "equivalent", "different", "undecided"


def verdict(low, high, margin):
    """Verdict on a difference whose 1 - 2 alpha interval is [low, high].

    Inside +-margin it is equivalent, which is two one-sided tests at alpha (Schuirmann 1987,
    Journal of Pharmacokinetics and Biopharmaceutics 15:657). Outside it is different: the same two
    tests turned round (a minimum-effect test: Murphy and Myors 1999, Journal of Applied Psychology
    84:234). Across a limit: undecided.
    """
    if not margin >= 0.0 or not low <= high:
        raise CalibrationError(f"no interval [{low:g}, {high:g}] or margin {margin:g} to judge by")
    if -margin <= low and high <= margin:
        return EQUIVALENT
    return DIFFERENT if low > margin or high < -margin else UNDECIDED


def limits(difference, se, freedom, alpha=ALPHA):
    """(low, high) of the 1 - 2 alpha interval of a difference with standard error `se` on `freedom`
    degrees."""
    half = float(stats.t.ppf(1.0 - alpha, freedom)) * se if se > 0.0 else 0.0
    return difference - half, difference + half


def welch(sd_a, n_a, sd_b, n_b):
    """Standard error of a difference of two means, and its degrees of freedom (Welch 1947,
    Biometrika 34:28).

    Without any scatter the error is 0 on infinitely many degrees of freedom.
    """
    a, b = sd_a**2 / n_a, sd_b**2 / n_b
    if a + b == 0.0:
        return 0.0, math.inf
    return math.sqrt(a + b), (a + b) ** 2 / (a**2 / (n_a - 1) + b**2 / (n_b - 1))


@dataclass(frozen=True)
class Paired:
    """Pairs of values. `bias` is their mean difference. `extra` is the standard deviation of the
    differences beyond the scatter of runs at one point. Each has its 1 - 2 alpha interval."""

    n: int
    bias: float
    se: float
    low: float
    high: float
    extra: float
    extra_low: float
    extra_high: float


def paired(differences, errors, alpha=ALPHA):
    """Bias of differences (n,) by the paired t interval, and their scatter beyond their standard
    `errors` (n,).

    The second takes the errors as known: the interval of the differences' variance by chi-square,
    less the mean squared error, and 0 where that is negative. Raises CalibrationError for fewer
    than two pairs.
    """
    d, known = np.asarray(differences, float), float(np.mean(np.square(errors)))
    n = len(d)
    if n < 2:
        raise CalibrationError(f"{n} pair has no scatter; two or more are needed")
    squares = float(((d - d.mean()) ** 2).sum())
    se = math.sqrt(squares / (n - 1) / n)
    low, high = limits(float(d.mean()), se, n - 1, alpha)
    total = [squares / (n - 1)]
    total += [squares / float(stats.chi2.ppf(q, n - 1)) for q in (1.0 - alpha, alpha)]
    extra = [math.sqrt(max(v - known, 0.0)) for v in total]
    return Paired(n, float(d.mean()), se, low, high, *extra)
