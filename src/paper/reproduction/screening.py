"""Tables 6 and 7: the Plackett-Burman runs and effects.

The screenings of the same study at other seeds count as repeats of its runs. Both sides ran the
same rows, so that an effect carries the same interactions in both, and the scatter between seeds
alone is the error of their difference.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from decimal import ROUND_HALF_UP, Decimal
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from calibration.chain.responses import with_value
from calibration.statistics.equivalence import Error
from calibration.statistics.screening import screen
from calibration.statistics.surface import pure_error
from paper.audit.paper import FACTORS, printed_number
from paper.audit.screening import screened
from paper.reproduction import rows as r
from paper.reproduction.chain import spread
from paper.reproduction.rows import Place

if TYPE_CHECKING:
    from paper.audit.paper import Paper
    from paper.reproduction.study import Study


CODES = list(FACTORS)
TABLE = "table06_plackett_burman"


def rows(paper: Paper, study: Study, repeats: Iterable[Study] = ()) -> Iterator[dict[str, Any]]:
    """Rows of Tables 6 and 7; repeats: the same study at other seeds."""
    runs, summary = study.table("screening", "runs"), study.summary("screening")
    if runs is None or summary is None:
        for item, name, what in (
            ("Table 6", "table06", "screening runs"),
            ("Table 7", "table07", "effects"),
        ):
            yield r.row(Place(item, name, what), None, None, r.NOT_RUN, "screening")
        return
    more = [own_half(s.table("screening", "runs")) for s in repeats]
    runs = own_half(runs)
    every = [runs, *(t for t in more if t is not None and _alike(t, runs))]
    yield from _runs(paper, study, every)
    yield from _effects(paper, study, every)


def own_half(runs: pd.DataFrame | None) -> pd.DataFrame | None:
    """The runs of the configured table, without those of a foldover, which the paper has not; None
    for None."""
    return runs if runs is None or "fold" not in runs else runs[runs["fold"] == 1]


def _alike(runs, first):
    """Whether both tables ran the same rows."""
    return (
        set(CODES) <= set(runs) & set(first)
        and len(runs) == len(first)
        and np.allclose(runs[CODES], first[CODES])
    )


def _scatter(paper, study, every):
    """(our standard deviation between seeds [deg], its degrees of freedom, the paper's): from the
    repeats, else from the validation."""
    own, n, theirs = spread(paper, study)
    if len(every) == 1:
        return own, None if n is None else n - 1, theirs
    valued = with_value(pd.concat(every, ignore_index=True), "response")
    square, freedom = pure_error(valued[CODES].to_numpy(float), valued["response"].to_numpy())
    return math.sqrt(square / freedom), freedom, theirs


def _runs(paper, study, every):
    own, _, theirs = _scatter(paper, study, every)
    alike = _alike(every[0], paper.numbers(TABLE, *CODES))
    for k, text in enumerate(paper.printed(TABLE, "angle_deg")):
        place = Place("Table 6", f"table06.run{k + 1}", f"angle of run {k + 1}", "deg", study.name)
        if alike:
            yield r.point(place, text, [t["response"].iloc[k] for t in every], own, theirs)
        else:
            reason = "this study ran another design"
            yield r.row(place, text.text, None, r.NOT_COMPARABLE, reason)


def _effects(paper, study, every):
    names = paper.text("table05_contact_parameter_ranges", "factor", "name")
    names = names.set_index("factor")["name"]
    effects = study.table("screening", "effects").set_index("code")
    theirs = screened(paper).table.set_index("code")["effect"]
    runs = with_value(pd.concat(every, ignore_index=True), "response")
    own = [c for c in CODES if c in effects.index and effects.loc[c, "name"] == names[c]]
    ours = screen(runs, own, runs["response"]).table.set_index("code") if own else None
    inverse = np.linalg.inv(np.cov(runs[own].T, bias=True).reshape(len(own), len(own)))
    sd, freedom, paper_sd = _scatter(paper, study, every)
    # of the paper's effects, by the scatter between its runs, that of Table 13
    paper_n = len(paper.numbers("table13_validation", "angle_deg"))
    their_error = Error(2.0 * paper_sd / math.sqrt(len(paper.text(TABLE))), paper_n - 1)
    for code in CODES:
        words = f"effect of {r.said(names[code])}"
        place = Place("Table 7", f"table07.{code}.effect", words, "deg", study.name, True)
        if code not in own or ours is None:
            yield r.row(place, None, None, r.NOT_COMPARABLE, "no factor of this study")
            continue
        printed, mine = _rounded(theirs[code]), float(ours.loc[code, "effect"])
        if sd is None:
            reason = "our spread is not known"
            yield r.row(place, printed.text, mine, r.NOT_COMPARABLE, reason)
            continue
        # of an effect, which is twice a slope; the columns are not orthogonal where a run is lost
        k = own.index(code)
        error = 2.0 * sd * math.sqrt(inverse[k, k] / len(runs))
        yield r.estimates(place, printed, mine, Error(error, freedom, len(runs)), their_error)


def _rounded(effect):
    """An effect to the two places of the angles, a half rounded away from zero. Printed decimals
    make halves often, and a computed one is off by its last digits, so it is read to twelve digits
    first."""
    number = Decimal(f"{float(effect):.12g}").quantize(Decimal("0.01"), ROUND_HALF_UP)
    return printed_number(f"{number:f}")
