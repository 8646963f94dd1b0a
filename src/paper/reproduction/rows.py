"""One row of the reproduction table, and the comparisons that decide its agreement.

Every agreement follows from numbers and from a margin stated beforehand (`margins`). It is
equivalent if the 90 % interval of the difference lies within the margin (two one-sided tests at 5
%), different if the interval lies outside, else undecided. If the paper prints no spread, its value
is taken to scatter as ours does, over the number of repeats that the paper states. `basis` says so.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from calibration.statistics.equivalence import (
    ALPHA,
    DIFFERENT,
    EQUIVALENT,
    UNDECIDED,
    limits,
    paired,
    verdict,
    welch,
)
from paper.audit.printed import Printed
from paper.reproduction import margins

NOT_RUN, NOT_COMPARABLE, NO_NUMBER = "not run", "not comparable", "no number"
ARITHMETIC, SETTINGS, ENGINE = "the paper's arithmetic", "set from the paper", "our runs"
"""What a row is evidence of: the paper's figures against its own data, values that this study takes
from the paper (so they cannot differ), or values of the engine's runs."""
COLUMNS = (
    "item",
    "id",
    "quantity",
    "unit",
    "paper",
    "this_project",
    "sd",
    "n",
    "difference",
    "se",
    "low",
    "high",
    "margin",
    "agreement",
    "evidence",
    "basis",
    "study",
    "headline",
)
"""item: table or equation; sd, n: of this project's value; difference, se, low, high: ours less the
paper's, its standard error and 90 % interval; margin: what the agreement is judged by."""


@dataclass(frozen=True)
class Place:
    """What a row is about: the paper's table or equation, an id, the quantity, its unit, the study
    it is from, whether the README shows it, and what it is evidence of."""

    item: str
    id: str
    quantity: str
    unit: str = "1"
    study: str = ""
    headline: bool = False
    evidence: str = ENGINE


def _row(place, paper, ours, agreement, basis, **numbers):
    row = {
        "item": place.item,
        "id": place.id,
        "quantity": place.quantity,
        "unit": place.unit,
        "paper": paper,
        "this_project": ours,
        "agreement": agreement,
        "evidence": place.evidence,
        "basis": basis,
        "study": place.study,
        "headline": place.headline,
    }
    return {c: (row | numbers).get(c) for c in COLUMNS}


def _judged(place, paper, ours, difference, interval, margin, basis, **numbers):
    """Row of a difference whose `interval` (low, high) is held against the margin."""
    low, high = interval
    numbers |= {"difference": difference, "low": low, "high": high, "margin": margin}
    return _row(place, paper, ours, verdict(low, high, margin), basis, **numbers)


def _decide(place, printed, ours, error, basis, margin=None, **numbers):
    """Row of a difference with `error`, its (standard error, degrees of freedom)."""
    apart, margin = ours - printed.value, _margin(place, printed, margin)
    interval = limits(apart, *error)
    numbers |= {"se": error[0]}
    return _judged(place, printed.text, ours, apart, interval, margin, basis, **numbers)


def _margin(place, printed, margin):
    """The stated margin, and never less than the printed digits leave open."""
    stated = margins.by_unit(place.unit, printed.value) if margin is None else margin
    return max(stated, margins.of_printing(printed))


def means(place, printed, ours, sd, n, paper_sd=None, paper_n=1):
    """Two means: ours of n runs with standard deviation sd, the paper's of paper_n with paper_sd
    where known."""
    if sd is None or n is None or n < 2:
        return without_spread(place, printed, ours)
    if paper_sd is None:
        error = sd * math.sqrt(1 / n + 1 / paper_n), n - 1
        basis = f"mean of {n}; the paper's, of {paper_n}, taken to scatter as ours"
    else:
        error = welch(sd, n, paper_sd, paper_n)
        basis = f"Welch interval of means of {n} and {paper_n}"
    return _decide(place, printed, ours, error, basis, sd=sd, n=n)


def single_run(place, printed, ours, sd, n, paper_sd=None):
    """A run of ours beside one of theirs. sd: between our seeds, known from n runs; paper_sd:
    between the paper's runs. Ours may have no value, as of a funnel that clogged."""
    if math.isnan(ours):
        return absent(place, printed.text, NO_NUMBER, "our run gave no value")
    if sd is None:
        return without_spread(place, printed, ours)
    error = math.hypot(sd, sd if paper_sd is None else paper_sd), n - 1
    return _decide(
        place, printed, ours, error, "one run each; scatter between runs at one point", sd=sd, n=1
    )


def estimates(place, printed, ours, se, freedom, paper_se=None, margin=None):
    """Two fitted numbers with standard errors; without one of the paper's its printed value counts
    as exact."""
    error = math.hypot(se, paper_se or 0.0), freedom
    basis = "standard errors of both fits" if paper_se else "standard error of our fit"
    return _decide(place, printed, ours, error, basis, margin, sd=se)


def within(place, printed, ours, low, high, basis, margin=None):
    """The paper's value against our own interval [low, high] of at least 90 %. Ours may be no
    number, as R² predicted where one run alone decides a coefficient."""
    if math.isnan(ours):
        return absent(place, printed.text, NO_NUMBER, "ours is no number")
    interval = low - printed.value, high - printed.value
    apart, margin = ours - printed.value, _margin(place, printed, margin)
    return _judged(place, printed.text, ours, apart, interval, margin, basis)


def spreads(place, paper_sd, paper_n, sd, n):
    """Two standard deviations: the interval of their ratio by F, judged by the share that counts
    for scatter."""
    ratio = sd / paper_sd
    low, high = (ratio / math.sqrt(stats.f.ppf(q, n - 1, paper_n - 1)) for q in (1 - ALPHA, ALPHA))
    interval = (low - 1.0) * paper_sd, (high - 1.0) * paper_sd
    margin, basis = margins.SCATTER_SHARE * paper_sd, f"F interval of {n} and {paper_n} runs"
    return _judged(place, f"{paper_sd:.3f}", sd, sd - paper_sd, interval, margin, basis, n=n)


def exact(place, printed, ours, basis):
    """A number without scatter: recomputed from the paper's own data, or set from it; judged by its
    printed digits."""
    return _decide(place, printed, ours, (0.0, math.inf), basis, margin=0.0)


def whole(place, parts, margin):
    """The mean difference of a table's rows by the paired t interval."""
    basis = "paired t of {} differences"
    return _of_all(place, parts, margin, basis, lambda p: (p.bias, p.se, p.low, p.high))


def beyond(place, parts, margin):
    """How much the differences of a table's rows scatter about their mean beyond what single runs
    do."""
    basis = "standard deviation of {} differences less that of the runs, chi-square"
    return _of_all(
        place, parts, margin, basis, lambda p: (p.extra, None, p.extra_low, p.extra_high)
    )


def _of_all(place, parts, margin, basis, part):
    """Row of what `part` takes of the differences of a table's rows: value, its standard error or
    None, and interval."""
    judged = [row for row in parts if row["se"] is not None]
    if len(judged) < 2:
        reason = "fewer than two of its values are compared"
        return absent(place, None, NOT_COMPARABLE, reason)
    found = paired([row["difference"] for row in judged], [row["se"] for row in judged])
    value, se, low, high = part(found)
    basis, own = basis.format(found.n), {"n": found.n, "se": se}
    return _judged(place, 0, value, value, (low, high), margin, basis, **own)


def words(place, paper, ours, basis):
    """Statements in words or sets: equal, or not, or undecided where one of the two is."""
    same = EQUIVALENT if paper == ours else DIFFERENT
    return _row(place, paper, ours, UNDECIDED if UNDECIDED in (paper, ours) else same, basis)


def matters(p, alpha, low=None, high=None, margin=None):
    """Whether an effect is there: yes by its p, no only where its 90 % interval [low, high] lies
    within the margin."""
    if p < alpha:
        return "yes"
    if margin is None:
        return UNDECIDED
    return "no" if verdict(low, high, margin) == EQUIVALENT else UNDECIDED


def without_spread(place, printed, ours):
    """A number of ours whose spread is not known, so that no agreement can be computed."""
    apart = ours - printed.value
    reason = "our spread is not known"
    return _row(place, printed.text, ours, NOT_COMPARABLE, reason, difference=apart)


def absent(place, paper, agreement, basis, ours=None):
    """A row without comparison: the stage has not run, the points differ, or the item holds no
    number."""
    return _row(place, paper, ours, agreement, basis)


def printed_of(value, digits=None):
    """`Printed` of a text, or of a number computed from printed ones, to `digits` places."""
    text = value if isinstance(value, str) else f"{value:.{digits}f}"
    found = Printed.parse(text)
    if found is None:
        raise ValueError(f"{text!r} is not a number")
    return found


def line_fit(matrix, response):
    """Least squares: coefficients (p,), their covariance (p, p), residual degrees of freedom."""
    coefficients, *_ = np.linalg.lstsq(matrix, response, rcond=None)
    left = response - matrix @ coefficients
    freedom = len(response) - matrix.shape[1]
    return coefficients, float(left @ left) / freedom * np.linalg.inv(matrix.T @ matrix), freedom
