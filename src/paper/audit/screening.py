"""Tables 5, 6, 7 and 10: the screening and the steepest ascent."""

from functools import lru_cache

import numpy as np

from calibration.statistics.screening import Screening, screen
from paper.audit.paper import FACTORS, NAMES, Cells, Claims, Found, Paper

ANOVA = "sum_sq df mean_sq F p"
DESIGN, PATH = "table06_plackett_burman", "table10_steepest_ascent"
RANGES = "table05_contact_parameter_ranges"


@lru_cache(maxsize=1)
def screened(paper: Paper) -> Screening:
    """Main effects of the Plackett-Burman design."""
    design = paper.numbers(DESIGN, *FACTORS, "angle_deg")
    return screen(design, list(FACTORS), design.angle_deg)


def _anova(paper):
    return screened(paper).anova.set_index("source").astype(float)


def _ranges(paper):
    return paper.keyed(RANGES, "name", "low", "high")


def _letters(paper):
    """The factors' letters by name."""
    return paper.text(RANGES, "factor", "name").set_index("name").factor


def _twice(paper, claim):
    ratios = (_ranges(paper).high / _ranges(paper).low).round(6)
    return Found((ratios == 2).sum(), ratios=", ".join(f"{r:.2f}" for r in ratios))


def _orthogonal(paper, claim):
    terms = paper.numbers(DESIGN, *FACTORS).assign(mean=1.0).to_numpy()
    return Found(np.abs(np.triu(terms.T @ terms, k=1)).max(), exact=True)


def _coded(paper, claim):
    odd = paper.numbers("table06_printed_levels", "E_printed").E_printed
    odd = odd[~odd.isin((-1, 1))]
    natural = set(odd) == {_ranges(paper).high["salt_salt_restitution"]}
    what = (
        "the natural high level of Table 5 and stands for +1" if natural else "no level of Table 5"
    )
    return Found(len(odd), shown=", ".join(f"{c:g}" for c in sorted(set(odd))), what=f"is {what}")


def _significant(paper, claim):
    p = _anova(paper).p[list(FACTORS)]
    found = p.index[p < 0.01 if claim.part == "highly" else p > 0.05]
    holds = set(claim.printed.split()) == set(found)
    return Found(" ".join(found), holds=holds, smallest=p[~(p < 0.01)].min())


def _path(paper):
    return paper.numbers(PATH, "level", *NAMES, "angle_deg")


def _relative_error(paper, row):
    target = paper.value("measured_angle_of_repose")
    return abs(float(row["angle_deg"]) - target) / target


def _start(paper, claim):
    centres = _ranges(paper).mean(axis=1)
    return {
        axis: Found(centres[name], exact=True, printed=paper.text(PATH, axis)[axis][0])
        for axis, name in NAMES.items()
    }


def _step(paper, claim):
    """The step of an axis that goes with X's when both follow the screening's coefficients per
    coded unit."""
    axis = claim.id[-1].upper()
    slope = screened(paper).table.set_index("code").effect / 2
    half = (_ranges(paper).high - _ranges(paper).low) / 2
    x, y = NAMES["X"], NAMES[axis]
    letters = _letters(paper)
    step_x = float(_path(paper).X.diff().iloc[1])
    step = step_x / half[x] * slope[letters[y]] / slope[letters[x]] * half[y]
    # the first step down the column, to the column's finest digit
    cells = paper.printed(PATH, axis)
    decimals = max(len(x.text.partition(".")[2]) for x in cells)
    printed = f"{cells[1].value - cells[0].value:.{decimals}f}"
    return Found(step, printed=printed, axis=axis, times=abs(float(printed) / step))


def _best(paper, claim):
    table, target = _path(paper), paper.value("measured_angle_of_repose")
    printed_gap, gap = (
        np.diff(np.sort((table.angle_deg - t).abs()))[0]
        for t in (target, paper.angles().angle_deg.mean())
    )
    best = table.level[(table.angle_deg - target).abs().idxmin()]
    return Found(int(best), printed_gap=printed_gap, gap=gap)


def _levels(paper, claim):
    """The level of Table 10 whose values the coding of Table 11 uses. X gives the direction (Y
    falls as X rises)."""
    coding = paper.keyed("table11_coding", "factor", "low", "high")
    ends = {"X": claim.part, "Y": {"low": "high", "high": "low"}[claim.part], "Z": claim.part}
    table = _path(paper)
    same = [np.isclose(table[axis], coding.loc[axis, end]) for axis, end in ends.items()]
    match = table.level[np.all(same, axis=0)]
    said = table[table.level == claim.value]
    span = ", ".join(f"{axis} {said[axis].iloc[0]:g}" for axis in NAMES) if len(said) else ""
    return Found(int(match.iloc[0]) if len(match) else "none", span=span or "no level")


CLAIMS: Claims = {
    "table05.twice": _twice,
    "table06.orthogonal": _orthogonal,
    "table06.coded": _coded,
    "table07.highly table07.others": _significant,
    "table07.first": lambda paper, _: _anova(paper).p[_letters(paper)[list(NAMES.values())]].max(),
    "ascent.start": _start,
    "ascent.step_y ascent.step_z": _step,
    "ascent.best": _best,
    "ascent.low ascent.high": _levels,
}
CELLS: Cells = {
    "table07.{source}.{cell}": (
        "table07_plackett_burman_anova", ANOVA,
        lambda paper, row: _anova(paper).loc[row["source"], row["cell"]],
    ),
    "table10.error.{level}": (PATH, "relative_error_printed", _relative_error),
}  # fmt: skip
