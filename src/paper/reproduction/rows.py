"""One row of the reproduction table, and the comparisons that decide its agreement.

Every agreement follows from numbers and from a margin, a difference that does not matter, stated
beforehand by kind of quantity and not by result. It is
equivalent if the 90 % interval of the difference lies within the margin (two one-sided tests at 5
%) and different if the interval lies outside. Else it is undecided, with the number of further runs
that would decide it, or undecidable where the paper's own error is too wide for any number of runs.
If the paper prints no spread, its value is taken to scatter as ours does, over the number of
repeats that the paper states. `basis` says so.

Single runs are not judged one by one. The rows of such a table are judged together (`whole`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

from calibration.figures import label
from calibration.statistics import equivalence as eq
from paper.audit.paper import Printed

NOT_RUN, NOT_COMPARABLE, NO_NUMBER = "not run", "not comparable", "no number"
IN_TABLE = "judged with its table"
COLUMNS = (
    "item", "id", "quantity", "unit", "paper", "this_project", "sd", "n", "difference", "se", "low",
    "high", "margin", "agreement", "more_runs", "basis", "study", "headline",
)  # fmt: skip
"""item: table or equation; sd, n: of this project's value; difference, se, low, high: ours less the
paper's, its standard error and 90 % interval; margin: what the agreement is judged by; more_runs:
how many further runs would decide what is undecided, at the difference and the scatter found."""


ANGLE_DEG = 1.0
"""Of angles, effects on angles and coefficients in coded levels: the default of
`validation.margin`."""
SHARE = 0.05
"""Of lengths, frictions, restitutions and slopes: a share of the printed value."""
R2_MARGIN = 0.05
"""Of coefficients of determination, which are shares already."""
SCATTER_SHARE = 0.25
"""Of measures of scatter (standard deviation, CV, adequate precision): known to a fifth from ten
repeats."""
SCALING = {"heap": 2.0, "drop": 0.02}
"""Of the range over scales [deg; 1]: the defaults of the scaling study."""


@dataclass(frozen=True)
class Place:
    """What a row is about: the paper's table or equation, an id, the quantity, its unit, the study
    it is from, and whether docs/results.md shows it."""

    item: str
    id: str
    quantity: str
    unit: str = "1"
    study: str = ""
    headline: bool = False


def row(
    place: Place, basis: str, paper: str | float | None = None, ours: str | float | None = None,
    agreement: str = NOT_COMPARABLE, **numbers: Any,
) -> dict[str, Any]:  # fmt: skip
    """A row; numbers: further columns. Where nothing is compared `agreement` and `basis` say why:
    the stage has not run, the points differ, or the item holds no number."""
    told = {"paper": paper, "this_project": ours, "agreement": agreement, "basis": basis}
    return dict.fromkeys(COLUMNS) | asdict(place) | told | numbers


def _judged(place, paper, ours, difference, decision, margin, basis, **numbers):
    """Row of a difference that was decided against the margin."""
    if decision.verdict == eq.UNDECIDABLE:
        basis = f"{basis}; more runs of ours would not decide it"
    numbers |= {"difference": difference, "margin": margin} | asdict(decision)
    return row(place, basis, paper, ours, numbers.pop("verdict"), **numbers)


def _margin(place, printed, margin):
    """The stated margin, and never less than the printed digits leave open."""
    stated = by_unit(place.unit, printed.value) if margin is None else margin
    return max(stated, printed.half_unit * (1.0 + 1e-9))


def by_unit(unit: str, value: float) -> float:
    """Margin of a quantity in `unit` whose printed value is `value`."""
    return ANGLE_DEG if unit == "deg" else SHARE * abs(value)


def reach(drawn: np.ndarray, value: float) -> tuple[float, float]:
    """(below, above) of the 90 % interval of a statistic from draws of it (n,)."""
    low, high = np.quantile(drawn, (eq.ALPHA, 1.0 - eq.ALPHA))
    return value - low, high - value


def said(name: str) -> str:
    """A factor's name in words, as it stands behind "effect of": "rolling friction, salt on
    steel"."""
    words = label(name)
    return words.replace(" of ", ", ", 1) if " on " in words else words


def means(
    place: Place,
    printed: Printed,
    ours: float,
    sd: float | None,
    n: int | None,
    paper_sd: float | None = None,
    paper_n: int = 1,
) -> dict[str, Any]:
    """Two means: ours of n runs with standard deviation sd, the paper's of paper_n with paper_sd
    where known."""
    if sd is None or n is None or n < 2:
        return _without_spread(place, printed, ours)
    own = eq.Error(sd / math.sqrt(n), n - 1, n)
    if paper_sd is None:
        theirs = eq.Error(sd / math.sqrt(paper_n), n - 1)
        basis = f"mean of {n}; the paper's, of {paper_n}, taken to scatter as ours"
    else:
        theirs = eq.Error(paper_sd / math.sqrt(paper_n), paper_n - 1)
        basis = f"Welch interval of means of {n} and {paper_n}"
    return estimates(place, printed, ours, own, theirs, basis=basis) | {"sd": sd}


def _without_spread(place, printed, ours):
    """A number of ours whose spread is not known, so that no agreement can be computed."""
    apart = ours - printed.value
    return row(place, "our spread is not known", printed.text, ours, difference=apart)


def point(
    place: Place,
    printed: Printed,
    ours: npt.ArrayLike,
    sd: float | None,
    paper_sd: float | None,
    repeats: int = 1,
) -> dict[str, Any]:
    """A point of a table: the mean of our runs (n,) beside one of theirs. sd: between our seeds;
    paper_sd: between the paper's runs; repeats: how many runs each of ours is the mean of. Its
    table is judged, not it (`whole`). Runs may have no value, as of a funnel that clogged."""
    values = np.array(ours, float)
    values = values[np.isfinite(values)]
    if not len(values):
        return row(place, "our run gave no value", printed.text, agreement=NO_NUMBER)
    mean, n = float(values.mean()), repeats * len(values)
    if sd is None or paper_sd is None:
        return _without_spread(place, printed, mean)
    error, apart = math.hypot(sd / math.sqrt(n), paper_sd), mean - printed.value
    basis = f"{n} of our runs beside one of theirs; scatter between runs at one point"
    numbers = {"sd": sd, "n": n, "se": error, "difference": apart}
    return row(place, basis, printed.text, mean, IN_TABLE, **numbers)


def estimates(
    place: Place,
    printed: Printed,
    ours: float,
    own: eq.Error,
    theirs: eq.Error | None = None,
    margin: float | None = None,
    basis: str = "",
) -> dict[str, Any]:
    """Two numbers with errors (`Error`), fitted ones where `basis` says nothing else; without one
    of the paper's its printed value counts as exact."""
    apart, margin = ours - printed.value, _margin(place, printed, margin)
    basis = basis or ("standard errors of both fits" if theirs else "standard error of our fit")
    theirs = theirs or eq.EXACT
    decision = eq.decide_difference(apart, own, theirs, margin)
    if decision.verdict == eq.UNDECIDABLE:
        basis = f"{basis}; the paper's own standard error is {theirs.se:.2g}"
    numbers = {"sd": own.se, "n": own.runs, "se": own.beside(theirs)[0]}
    return _judged(place, printed.text, ours, apart, decision, margin, basis, **numbers)


def within(
    place: Place,
    printed: Printed,
    ours: float,
    reach: tuple[float, float],
    basis: str,
    margin: float | None,
    runs: int,
    paper_reach: tuple[float, float] = (0.0, 0.0),
) -> dict[str, Any]:
    """The paper's value beside ours, each with its 90 % `reach` (below, above) to both sides, of
    which ours narrows with the root of `runs`. Ours may be no number, as R² predicted where one run
    alone decides a coefficient."""
    if math.isnan(ours):
        return row(place, "ours is no number", printed.text, agreement=NO_NUMBER)
    apart, margin = ours - printed.value, _margin(place, printed, margin)
    below, above = (max(x, 0.0) for x in reach)
    paper_below, paper_above = (max(x, 0.0) for x in paper_reach)

    def interval(count):
        share = math.sqrt(runs / count)
        low = apart - math.hypot(share * below, paper_above)
        return low, apart + math.hypot(share * above, paper_below)

    decision = eq.decide(interval, runs, margin)
    return _judged(place, printed.text, ours, apart, decision, margin, basis, n=runs)


def spreads(place: Place, paper_sd: float, paper_n: int, sd: float, n: int) -> dict[str, Any]:
    """Two standard deviations: the interval of their ratio by F, judged by the share that counts
    for scatter."""
    ratio = sd / paper_sd

    def interval(count):
        free = min(count - 1, 1e9)  # as good as infinitely many
        ends = np.sqrt(stats.f.ppf([1 - eq.ALPHA, eq.ALPHA], free, paper_n - 1))
        return tuple((ratio / end - 1.0) * paper_sd for end in ends.tolist())

    margin, basis = SCATTER_SHARE * paper_sd, f"F interval of {n} and {paper_n} runs"
    decision = eq.decide(interval, n, margin)
    return _judged(place, f"{paper_sd:.3f}", sd, sd - paper_sd, decision, margin, basis, n=n)


def whole(item: str, unit: str, rows: Iterable[Mapping[str, Any]], study: str) -> dict[str, Any]:
    """The row about a table of single runs, judged as one of all rows that there are: the root mean
    square of the true differences of its own (`equivalence.together`), which the scatter of the
    runs on both sides is taken off. study: whose they are where none says it."""
    parts = [x for x in rows if x["item"] == item and x["agreement"] == IN_TABLE]
    name = min({x["study"] for x in parts if x["study"]} or {study})
    text = f"difference of {len(parts)} values beyond the runs' scatter (root mean square)"
    place = Place(item, f"{item.lower().replace(' ', '')}.whole", text, unit, name, True)
    if len(parts) < 2:
        return row(place, "fewer than two of its values are compared")
    margin = by_unit(unit, sum(abs(float(x["paper"])) for x in parts) / len(parts))
    own = [x["sd"] / math.sqrt(x["n"]) for x in parts]
    square = [float(np.mean(np.square(x))) for x in (own, [x["se"] for x in parts])]
    runs = int(sum(x["n"] for x in parts))
    scatter = math.sqrt(square[0]), math.sqrt(max(square[1] - square[0], 0.0))
    found = eq.together([x["difference"] for x in parts], *scatter, runs, margin)
    basis = (
        f"{found.n} differences: mean {found.mean:+.2f}, root mean square {found.rms:.2f}, of "
        f"which the runs' scatter makes {math.sqrt(square[1]):.2f} (p = {found.p:.2g})"
    )
    return _judged(place, 0, found.beyond, found.beyond, found.decision, margin, basis, n=runs)


def words(place: Place, paper: str, ours: str, basis: str) -> dict[str, Any]:
    """Statements in words or sets: equal, or not, or undecided where one of the two is."""
    same = eq.EQUIVALENT if paper == ours else eq.DIFFERENT
    open_ones = [x for x in (eq.UNDECIDED, eq.UNDECIDABLE) if x in (paper, ours)]
    return row(place, basis, paper, ours, open_ones[0] if open_ones else same)
