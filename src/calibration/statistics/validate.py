"""Replicates: how many their mean needs, and runs at the optimum beside the measurement:
difference, interval, t test, equivalence test.

How many is Stein's two-stage rule (1945, Annals of Mathematical Statistics 16:243). The spread of a
first sample decides how many values there are in all; the interval of their mean takes the first
sample's spread and its degrees of freedom. The mean of all and that spread are independent, so the
interval holds the true mean as often as it states, whatever the spread is. A sample that simply
ends where its own interval is narrow enough ends too early too often.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
import numpy.typing as npt
import scipy

from calibration.errors import CalibrationError
from calibration.statistics.equivalence import ALPHA, Error, decide_difference


@dataclass(frozen=True)
class Stated:
    """Measured values, or means of batches, of which only mean, standard deviation and number are
    known; it answers as an array of them would."""

    value: float
    sd: float
    n: int
    of: str = "values"

    def mean(self) -> float:
        """Their mean."""
        return self.value

    def std(self, ddof: int = 1) -> float:
        """Their standard deviation, of ddof 1."""
        return self.sd

    def var(self, ddof: int = 1) -> float:
        """Their variance, of ddof 1."""
        return self.sd**2

    def __len__(self) -> int:
        return self.n


@dataclass(frozen=True)
class Comparison:
    """Simulated against measured; angles or any other unit.

    more_runs: how many more would show that the means are equivalent, or differ by more than the
    margin, with the difference and the scatter as found; None where one is shown, or where no
    number of runs would."""

    simulated_mean: float
    simulated_sd: float
    simulated_n: int
    measured_mean: float
    measured_sd: float
    measured_n: int
    difference: float
    difference_low: float
    difference_high: float
    relative_error_percent: float
    t: float
    t_p: float
    margin: float
    equivalence_p: float
    equivalent: bool
    equivalence_low: float
    equivalence_high: float
    more_runs: int | None


def compare(
    simulated: npt.ArrayLike, measured: npt.ArrayLike | Stated, margin: float, alpha: float = 0.05
) -> Comparison:
    """Compare simulated values with measured (n,) ones, or a `Stated` mean of them.

    All simulated values count as independent: runs that differ in their seed alone are, whatever
    group (a row) a table puts them in.

    The interval of the difference and the tests are Welch's, of unequal variances. The equivalence
    test is two one-sided tests against +-margin (Schuirmann 1987, Journal of Pharmacokinetics and
    Biopharmaceutics 15:657). Its p is the larger of the two. Below alpha the means are equivalent:
    the 1 - 2 alpha interval of the difference (equivalence_low to equivalence_high) then lies
    within the margin. Raises CalibrationError for missing values, fewer than two on a side, no
    scatter at all, or a margin that is not positive.
    """
    s = np.asarray(simulated, float).ravel()
    m = measured if isinstance(measured, Stated) else np.asarray(measured, float).ravel()
    _check(s, m, margin)
    difference = float(s.mean() - m.mean())
    vs, vm = s.var(ddof=1) / len(s), m.var(ddof=1) / len(m)
    se = float(np.sqrt(vs + vm))
    df = (vs + vm) ** 2 / (vs**2 / (len(s) - 1) + vm**2 / (len(m) - 1))
    half, narrow = scipy.stats.t.ppf(1 - alpha / 2, df) * se, scipy.stats.t.ppf(1 - alpha, df) * se
    t = difference / se
    below = scipy.stats.t.sf((difference + margin) / se, df)
    one_sided = max(below, scipy.stats.t.cdf((difference - margin) / se, df))
    own, theirs = Error(vs**0.5, len(s) - 1, len(s)), Error(vm**0.5, len(m) - 1)
    decision = decide_difference(difference, own, theirs, margin, alpha)
    return Comparison(
        float(s.mean()), float(s.std(ddof=1)), len(s), float(m.mean()), float(m.std(ddof=1)),
        len(m),
        difference, difference - half, difference + half, 100.0 * abs(difference) / float(m.mean()),
        float(t), float(2 * scipy.stats.t.sf(abs(t), df)), margin, float(one_sided),
        bool(one_sided < alpha),
        difference - narrow, difference + narrow, decision.more_runs,
    )  # fmt: skip


def _check(simulated, measured, margin):
    for name, values in (("simulated", simulated), ("measured", measured)):
        n = len(values)
        if n < 2:
            raise CalibrationError(f"{n} {name} value has no spread; two or more are needed")
    if not np.isfinite(simulated).all():
        raise CalibrationError("a simulated value is not finite")
    if np.ptp(simulated) == 0.0 and measured.std() == 0.0:
        raise CalibrationError("neither simulated nor measured values scatter; nothing to test")
    if not margin > 0.0:
        raise CalibrationError(f"the margin of equivalence must be above 0, not {margin:g}")


def runs_needed(first: Sequence[float] | np.ndarray, half_width: float, at_most: int) -> int:
    """Number of normal values in all, the first ones among them, so that the 95 % interval of
    their mean reaches no further than `half_width` to a side; no more than `at_most`, whose
    interval is wider and holds the true mean as often.

    first : (n,) values of the first sample, two or more
    half_width : above 0, in the values' unit
    """
    needed = ceil((_reach(first) / half_width) ** 2)
    return max(len(first), min(needed, at_most))


def mean_interval(values: Sequence[float] | np.ndarray, first: int) -> tuple[float, float]:
    """(mean, half width) of the 95 % interval of the true mean.

    values : (n,) all values, of which the leading `first` decided how many there are; where no
        others were added, it is Student's interval
    """
    return float(np.mean(values)), _reach(values[:first]) / sqrt(len(values))


def _reach(first):
    """Half width [the values' unit] of the interval of a single value."""
    return float(scipy.special.stdtrit(len(first) - 1, 1.0 - ALPHA / 2.0) * np.std(first, ddof=1))
