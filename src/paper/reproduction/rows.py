"""One row of the reproduction table, and the comparisons that decide its agreement.

Every agreement follows from numbers: a difference agrees where its 95 % interval, widened by half a unit of the last
printed digit, holds zero. Where the paper prints no spread of its own, its value is taken to scatter as ours does over
the number of repeats that it states; `basis` says so.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from paper.audit.printed import Printed

ALPHA = 0.05
AGREES, DISAGREES = "agrees", "disagrees"
NOT_RUN, NOT_COMPARABLE, NO_NUMBER = "not run", "not comparable", "no number"
COLUMNS = (
    "item", "id", "quantity", "unit", "paper", "this_project", "sd", "n", "difference", "low", "high",
    "agreement", "basis", "study", "headline",
)  # fmt: skip
"""item: table or equation; sd, n: of this project's value; difference, low, high: ours less the paper's, 95 %."""


@dataclass(frozen=True)
class Place:
    """What a row is about: the paper's table or equation, an id, the quantity, its unit, the study it is from."""

    item: str
    id: str
    quantity: str
    unit: str = "1"
    study: str = ""
    headline: bool = False


def _row(place, paper, ours, agreement, basis, **numbers):
    row = {
        "item": place.item, "id": place.id, "quantity": place.quantity, "unit": place.unit, "paper": paper,
        "this_project": ours, "agreement": agreement, "basis": basis, "study": place.study,
        "headline": place.headline,
    }  # fmt: skip
    return {c: (row | numbers).get(c) for c in COLUMNS}


def _decide(place, printed, ours, half, basis, sd=None, n=None):
    """Row of a difference whose 95 % interval has the half width `half`."""
    apart = ours - printed.value
    agreement = AGREES if abs(apart) <= half + printed.half_unit * (1 + 1e-9) else DISAGREES
    return _row(
        place, printed.text, ours, agreement, basis, sd=sd, n=n, difference=apart, low=apart - half, high=apart + half
    )  # fmt: skip


def means(place, printed, ours, sd, n, paper_sd=None, paper_n=1):
    """Two means: ours of n runs with standard deviation sd, the paper's of paper_n with paper_sd where known."""
    if sd is None or n is None or n < 2:
        return without_spread(place, printed, ours)
    if paper_sd is None:
        se, freedom = sd * math.sqrt(1 / n + 1 / paper_n), n - 1
        basis = f"mean of {n}; the paper's, of {paper_n}, taken to scatter as ours"
    else:
        parts = sd**2 / n, paper_sd**2 / paper_n
        se = math.sqrt(sum(parts))
        freedom = sum(parts) ** 2 / (parts[0] ** 2 / (n - 1) + parts[1] ** 2 / (paper_n - 1))
        basis = f"Welch interval of means of {n} and {paper_n}"
    half = float(stats.t.ppf(1 - ALPHA / 2, freedom)) * se
    return _decide(place, printed, ours, half, basis, sd=sd, n=n)


def single_run(place, printed, ours, sd, n, paper_sd=None):
    """A run of ours beside one of theirs; sd between our seeds, known from n runs, and between the paper's runs."""
    if sd is None:
        return without_spread(place, printed, ours)
    se = math.hypot(sd, sd if paper_sd is None else paper_sd)
    half = float(stats.t.ppf(1 - ALPHA / 2, n - 1)) * se
    return _decide(
        place, printed, ours, half, "one run each; scatter between runs at one point", sd=sd, n=1
    )


def estimates(place, printed, ours, se, freedom, paper_se=None):
    """Two fitted numbers with standard errors; without one of the paper's its printed value counts as exact."""
    total = math.hypot(se, paper_se or 0.0)
    half = float(stats.t.ppf(1 - ALPHA / 2, freedom)) * total
    basis = "standard errors of both fits" if paper_se else "standard error of our fit"
    return _decide(place, printed, ours, half, basis, sd=se)


def within(place, printed, ours, low, high, basis):
    """The paper's value against our own 95 % interval [low, high]."""
    slack = printed.half_unit * (1 + 1e-9)
    agreement = AGREES if low - slack <= printed.value <= high + slack else DISAGREES
    return _row(
        place, printed.text, ours, agreement, basis, difference=ours - printed.value,
        low=low - printed.value, high=high - printed.value,
    )  # fmt: skip


def exact(place, printed, ours, basis):
    """A number without scatter: recomputed from the paper's own data, or set from it."""
    return _decide(place, printed, ours, 0.0, basis)


def overall(place, parts):
    """Whether the rows `parts` of one table agree as a whole: no more miss than 95 % intervals let miss by chance."""
    judged = [row["agreement"] for row in parts if row["agreement"] in (AGREES, DISAGREES)]
    missed, n = judged.count(DISAGREES), len(judged)
    allowed = int(stats.binom.ppf(1 - ALPHA / 2, n, ALPHA)) if n else 0
    basis = f"{missed} miss, {allowed} may by chance"
    agreement = (AGREES if missed <= allowed else DISAGREES) if n else NOT_COMPARABLE
    return _row(place, f"{n} values", f"{n - missed} agree", agreement, basis)


def words(place, paper, ours, basis):
    """Statements in words or sets, equal or not."""
    return _row(place, paper, ours, AGREES if paper == ours else DISAGREES, basis)


def without_spread(place, printed, ours):
    """A number of ours whose spread is not known, so that no agreement can be computed."""
    apart = ours - printed.value
    reason = "our spread is not known"
    return _row(place, printed.text, ours, NOT_COMPARABLE, reason, difference=apart)


def absent(place, paper, agreement, basis, ours=None):
    """A row without comparison: the stage has not run, the points differ, or the item holds no number."""
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
