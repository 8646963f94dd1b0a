"""Four verdicts on a difference, by a margin that was stated before the data were seen; runs at the
optimum beside the measurement; and how many replicates a mean needs.

`equivalent` and `different` are both proven, each at level alpha. If neither is proven, the verdict
is `undecided` where more runs of ours would decide, and `undecidable` where no number of them
would, because the other side's own error is too wide. Scatter therefore earns no verdict, and a
small difference known exactly is equivalent.

How many is Stein's two-stage rule (1945, Annals of Mathematical Statistics 16:243). The spread of a
first sample decides how many values there are in all; the interval of their mean takes the first
sample's spread and its degrees of freedom. The mean of all and that spread are independent, so the
interval holds the true mean as often as it states, whatever the spread is. A sample that simply
ends where its own interval is narrow enough ends too early too often.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from calibration.errors import CalibrationError

ALPHA = 0.05
EQUIVALENT, DIFFERENT, UNDECIDED = "equivalent", "different", "undecided"
UNDECIDABLE = "undecidable"
MOST_RUNS = 2**40
"""More runs than these are as many as one likes."""


def verdict(low: float, high: float, margin: float) -> str:
    """Verdict on a difference whose 1 - 2 alpha interval is [low, high].

    Inside +-margin it is equivalent, which is two one-sided tests at alpha (Schuirmann 1987,
    Journal of Pharmacokinetics and Biopharmaceutics 15:657). Outside it is different: the same two
    tests turned round (a minimum-effect test: Murphy and Myors 1999, Journal of Applied Psychology
    84:234). Across a limit: undecided. Raises CalibrationError for ends that do not ascend and for
    a negative margin.
    """
    if not margin >= 0.0 or not low <= high:
        raise CalibrationError(f"no interval [{low:g}, {high:g}] or margin {margin:g} to judge by")
    if -margin <= low and high <= margin:
        return EQUIVALENT
    return DIFFERENT if low > margin or high < -margin else UNDECIDED


def limits(
    difference: float, se: float, freedom: float, alpha: float = ALPHA
) -> tuple[float, float]:
    """(low, high) of the 1 - 2 alpha interval of a difference with standard error `se` on `freedom`
    degrees."""
    half = float(scipy.stats.t.ppf(1.0 - alpha, freedom)) * se if se > 0.0 else 0.0
    return difference - half, difference + half


@dataclass(frozen=True)
class Error:
    """Standard error of a value, its degrees of freedom, and how many runs of ours it comes from;
    None where more runs would not narrow it."""

    se: float
    freedom: float = math.inf
    runs: int | None = None

    def of(self, runs: float) -> "Error":
        """The error that as many `runs` of the same scatter would leave."""
        if self.runs is None or math.isnan(self.se):
            return self
        if math.isinf(runs):
            return Error(0.0, math.inf, self.runs)
        share = runs / self.runs
        return Error(self.se / math.sqrt(share), self.freedom * share, self.runs)

    def beside(self, other: "Error") -> tuple[float, float]:
        """(standard error, degrees of freedom) of the difference of two values (Satterthwaite 1946,
        Biometrics Bulletin 2:110)."""
        a, b = self.se**2, other.se**2
        if a + b == 0.0:
            return 0.0, math.inf
        return math.sqrt(a + b), (a + b) ** 2 / (a**2 / self.freedom + b**2 / other.freedom)


EXACT = Error(0.0)


@dataclass(frozen=True)
class Decision:
    """A verdict, the 1 - 2 alpha interval it follows from, and how many more runs of ours would
    decide what is undecided."""

    verdict: str
    low: float
    high: float
    more_runs: int | None = None


def decide(
    interval: Callable[[float], tuple[float, float]], runs: int | None, margin: float
) -> Decision:
    """The verdict on a difference whose interval after n runs of ours is interval(n).

    interval : (low, high) after so many runs at the difference that was found, narrower for more
    runs : how many there are; None where more would not narrow it
    The number of further runs is a plan: it takes the difference and the scatter as found.
    """
    low, high = interval(math.nan if runs is None else runs)
    found = verdict(low, high, margin)
    if found != UNDECIDED:
        return Decision(found, low, high)
    if runs is None or verdict(*interval(math.inf), margin) == UNDECIDED:
        return Decision(UNDECIDABLE, low, high)
    few, many = runs, 2 * runs
    while verdict(*interval(many), margin) == UNDECIDED and many < MOST_RUNS:
        few, many = many, 2 * many
    while many - few > 1:
        middle = (few + many) // 2
        if verdict(*interval(middle), margin) == UNDECIDED:
            few = middle
        else:
            many = middle
    return Decision(UNDECIDED, low, high, many - runs)


def decide_difference(
    difference: float, own: Error, other: Error, margin: float, alpha: float = ALPHA
) -> Decision:
    """The verdict on a difference of two values with errors of their own; ours is the first."""

    def interval(runs):
        error = own if math.isnan(runs) else own.of(runs)
        return limits(difference, *error.beside(other), alpha)

    return decide(interval, own.runs, margin)


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


def compare(
    simulated: npt.ArrayLike, measured: npt.ArrayLike | Stated, margin: float, alpha: float = ALPHA
) -> dict[str, Any]:
    """Compare simulated values with measured (n,) ones, or a `Stated` mean of them.

    All simulated values count as independent: runs that differ in their seed alone are, whatever
    group (a row) a table puts them in.

    The interval of the difference and the tests are Welch's, of unequal variances. The equivalence
    test is two one-sided tests against +-margin (Schuirmann 1987, Journal of Pharmacokinetics and
    Biopharmaceutics 15:657). Its p is the larger of the two. Below alpha the means are equivalent:
    the 1 - 2 alpha interval of the difference (equivalence_low to equivalence_high) then lies
    within the margin. more_runs: how many more would show that the means are equivalent, or differ
    by more than the margin, with the difference and the scatter as found; None where one is shown,
    or where no number of runs would. Raises CalibrationError for missing values, fewer than two on
    a side, no scatter at all, or a margin that is not positive.
    """
    s = np.asarray(simulated, float).ravel()
    m = measured if isinstance(measured, Stated) else np.asarray(measured, float).ravel()
    _check(s, m, margin)
    mean, aim = float(s.mean()), float(m.mean())
    difference = float(s.mean() - m.mean())
    vs, vm = s.var(ddof=1) / len(s), m.var(ddof=1) / len(m)
    se = float(np.sqrt(vs + vm))
    df = (vs + vm) ** 2 / (vs**2 / (len(s) - 1) + vm**2 / (len(m) - 1))
    low, high = limits(difference, se, df, alpha / 2.0)
    equivalence_low, equivalence_high = limits(difference, se, df, alpha)
    below = scipy.stats.t.sf((difference + margin) / se, df)
    one_sided = max(below, scipy.stats.t.cdf((difference - margin) / se, df))
    own, theirs = Error(vs**0.5, len(s) - 1, len(s)), Error(vm**0.5, len(m) - 1)
    return {
        "simulated_mean": mean,
        "simulated_sd": float(s.std(ddof=1)),
        "simulated_n": len(s),
        "measured_mean": aim,
        "measured_sd": float(m.std(ddof=1)),
        "measured_n": len(m),
        "difference": difference,
        "difference_low": low,
        "difference_high": high,
        "relative_error_percent": 100.0 * abs(difference) / aim,
        "t": float(difference / se),
        "t_p": float(2 * scipy.stats.t.sf(abs(difference / se), df)),
        "margin": margin,
        "equivalence_p": float(one_sided),
        "equivalent": bool(one_sided < alpha),
        "equivalence_low": equivalence_low,
        "equivalence_high": equivalence_high,
        "more_runs": decide_difference(difference, own, theirs, margin, alpha).more_runs,
    }


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
    needed = math.ceil((_reach(first) / half_width) ** 2)
    return max(len(first), min(needed, at_most))


def mean_interval(values: Sequence[float] | np.ndarray, first: int) -> tuple[float, float]:
    """(mean, half width) of the 95 % interval of the true mean.

    values : (n,) all values, of which the leading `first` decided how many there are; where no
        others were added, it is Student's interval
    """
    return float(np.mean(values)), _reach(values[:first]) / math.sqrt(len(values))


def _reach(first):
    """Half width [the values' unit] of the interval of a single value."""
    return float(scipy.special.stdtrit(len(first) - 1, 1.0 - ALPHA / 2.0) * np.std(first, ddof=1))


def rms_interval(mean_square: float, n: int, variance: float) -> tuple[float, float]:
    """(low, high) of the 1 - 2 ALPHA interval of the root mean square of n true differences.

    mean_square : of the n differences that were found, each with the error `variance`
    The ratio of both is a noncentral chi-square over n, whose noncentrality n true mean squares
    over the variance make; the interval is where its distribution gives 1 - ALPHA and ALPHA. For
    the upper end the ratio counts as 1 at least: differences smaller than the error makes them are
    luck and prove nothing.
    """
    if variance == 0.0:
        exact = math.sqrt(mean_square)
        return exact, exact

    def share(ratio, centre):
        return scipy.stats.ncx2.cdf(n * ratio, n, centre)

    def end(ratio, probability):
        if share(ratio, 0.0) <= probability:
            return 0.0
        top = 4.0 * n * (ratio + 1.0)
        while share(ratio, top) > probability:
            top *= 2.0
        centre = scipy.optimize.brentq(lambda c: share(ratio, c) - probability, 0.0, top)
        return math.sqrt(centre * variance / n)

    ratio = mean_square / variance
    return end(ratio, 1.0 - ALPHA), end(max(ratio, 1.0), ALPHA)


@dataclass(frozen=True)
class Together:
    """The differences of a table's rows, judged as one.

    mean, rms: of the differences; beyond: the root mean square of the true differences, 0 where the
    runs' scatter explains all; decision: on `beyond`, against the margin; p: chance of differences
    as large where no true one exists."""

    n: int
    mean: float
    rms: float
    beyond: float
    p: float
    decision: Decision


def together(
    differences: npt.ArrayLike, own: float, other: float, runs: int, margin: float
) -> Together:
    """Judge the differences (n,) of one table's rows by the root mean square of the true ones.

    own, other : root mean square standard error of our values and of theirs
    runs : how many runs of ours all rows have
    The rows are those of the table and no sample of others, so that differences that are known
    exactly are judged by their size.
    """
    d = np.asarray(differences, float)
    n, square, known = len(d), float(np.mean(d**2)), own**2 + other**2
    true = max(square - known, 0.0)

    def interval(count):
        error = other**2 if math.isinf(count) else own**2 * runs / count + other**2
        return rms_interval(square if count == runs else true + error, n, error)

    exact = 0.0 if square > 0.0 else 1.0
    p = float(scipy.stats.chi2.sf(n * square / known, n)) if known else exact
    decision = decide(interval, runs, margin)
    return Together(n, float(d.mean()), math.sqrt(square), math.sqrt(true), p, decision)


def verdict_of(found: Mapping[str, Any]) -> str:
    """Return whether heaps and readings are shown to be equivalent within the margin, or to differ
    by more than it; undecided where neither."""
    return verdict(found["equivalence_low"], found["equivalence_high"], found["margin"])


def judged(found: Mapping[str, Any], unit: str) -> str:
    """`verdict_of` in words, with the margin; unit as it is written behind a number."""
    margin = f"{found['margin']:g}{unit}"
    return {
        EQUIVALENT: f"equivalent within ±{margin}",
        DIFFERENT: f"different by more than {margin}",
        UNDECIDED: f"not shown to be equivalent within ±{margin}",
    }[verdict_of(found)]
