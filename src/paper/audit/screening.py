"""Tables 5, 6, 7 and 10: the screening and the steepest ascent."""

import numpy as np

from calibration.statistics.screening import screen
from paper.audit.evaluate import Cells, Found, Given, cells, check
from paper.audit.paper import Claim, Paper, Printed

FACTORS = tuple("ABCDEFG")
ANOVA = ("sum_sq", "df", "mean_sq", "F", "p")
ASCENT = {
    "X": "salt_salt_rolling_friction",
    "Y": "salt_salt_restitution",
    "Z": "salt_steel_rolling_friction",
}
PATH = "table10_steepest_ascent"
RANGES = "table05_contact_parameter_ranges"


def _design(paper):
    return paper.numbers("table06_plackett_burman", *FACTORS, "angle_deg")


def _screening(paper):
    """Main effects of the Plackett-Burman design."""
    table = _design(paper)
    return screen(table, list(FACTORS), table.angle_deg)


def _anova(paper):
    return _screening(paper).anova.set_index("source")


def _ranges(paper):
    return paper.numbers(RANGES, "low", "high").set_axis(paper.text(RANGES, "name").name)


def _letter(paper, name):
    table = paper.text(RANGES, "factor", "name")
    return dict(zip(table["name"], table.factor, strict=True))[name]


@check("table05.twice")
def twice(paper: Paper, claim: Claim) -> Given:
    ratios = (_ranges(paper).high / _ranges(paper).low).round(6)
    return Found(int((ratios == 2).sum()), names={"ratios": ", ".join(f"{r:.2f}" for r in ratios)})


@check("table06.orthogonal")
def orthogonal(paper: Paper, claim: Claim) -> Given:
    terms = _design(paper)[list(FACTORS)].assign(mean=1.0).to_numpy()
    products = terms.T @ terms
    return Found(float(np.abs(products - np.diag(np.diag(products))).max()), exact=True)


@check("table06.coded")
def coded(paper: Paper, claim: Claim) -> Given:
    odd = [x.value for x in paper.printed("table06_printed_levels", "E_printed")]
    odd = [c for c in odd if c not in (-1, 1)]
    natural = sorted(set(odd)) == [_ranges(paper).high["salt_salt_restitution"]]
    what = (
        "is the natural high level of Table 5 and stands for +1"
        if natural
        else "is no level of Table 5"
    )
    shown = ", ".join(f"{c:g}" for c in sorted(set(odd)))
    return Found(len(odd), names={"shown": shown, "what": what})


@cells
def anova_cells(paper: Paper) -> Cells:
    anova, name = _anova(paper), "table07_plackett_burman_anova"
    for row in paper.text(name, "source", *ANOVA).to_dict("records"):
        for column in ANOVA:
            names = {"source": row["source"], "column": column}
            found = Found(float(anova.loc[row["source"], column]), names=names)
            yield "table07.{source}.{column}", row[column], found


@check("table07.highly", "table07.others")
def significant(paper: Paper, claim: Claim) -> Given:
    p = _anova(paper).p[list(FACTORS)]
    chosen = p < 0.01 if claim.part == "highly" else p > 0.05
    found = [f for f in FACTORS if chosen[f]]
    holds = set(claim.printed.split()) == set(found)
    return Found(" ".join(found), holds=holds, names={"smallest": p[~(p < 0.01)].min()})


@check("table07.first")
def largest_p(paper: Paper, claim: Claim) -> Given:
    return float(_anova(paper).p[[_letter(paper, name) for name in ASCENT.values()]].max())


def _path(paper):
    return paper.numbers(PATH, "level", *ASCENT, "angle_deg")


@cells
def ascent_errors(paper: Paper) -> Cells:
    target = paper.value("measured_angle_of_repose")
    printed = paper.printed(PATH, "relative_error_printed")
    for row, cell in zip(_path(paper).itertuples(), printed, strict=True):
        found = Found(abs(row.angle_deg - target) / target, names={"level": f"{row.level:.0f}"})
        yield "table10.error.{level}", cell.text, found


@check("ascent.start")
def ascent_start(paper: Paper, claim: Claim) -> Given:
    centres = _ranges(paper).mean(axis=1)
    return {
        axis: Found(float(centres[name]), exact=True, printed=paper.printed(PATH, axis)[0].text)
        for axis, name in ASCENT.items()
    }


@check("ascent.step_y", "ascent.step_z")
def ascent_step(paper: Paper, claim: Claim) -> Given:
    """The step of an axis that goes with X's when both follow the screening's coefficients per
    coded unit."""
    axis = claim.id[-1].upper()
    slope = _screening(paper).table.set_index("code").effect / 2
    half = (_ranges(paper).high - _ranges(paper).low) / 2
    x, name = ASCENT["X"], ASCENT[axis]
    step_x = float(_path(paper).X.diff().iloc[1])
    step = step_x / half[x] * slope[_letter(paper, name)] / slope[_letter(paper, x)] * half[name]
    printed = _first_step(paper.printed(PATH, axis))
    names = {"axis": axis, "times": abs(float(printed) / step)}
    return Found(float(step), printed=printed, names=names)


def _first_step(cells: list[Printed]) -> str:
    """The first step down a column, printed to the column's finest digit."""
    decimals = max(len(x.text.partition(".")[2]) for x in cells)
    return f"{cells[1].value - cells[0].value:.{decimals}f}"


@check("ascent.best")
def ascent_best(paper: Paper, claim: Claim) -> Given:
    table, target = _path(paper), paper.value("measured_angle_of_repose")
    printed_gap, gap = (
        np.diff(np.sort((table.angle_deg - t).abs()))[0]
        for t in (target, paper.angles().angle_deg.mean())
    )
    best = table.level[(table.angle_deg - target).abs().idxmin()]
    return Found(int(best), names={"printed_gap": printed_gap, "gap": gap})


@check("ascent.low", "ascent.high")
def ascent_levels(paper: Paper, claim: Claim) -> Given:
    """The level of Table 10 whose values the coding of Table 11 uses. X gives the direction (Y
    falls as X rises)."""
    coding = paper.numbers("table11_coding", "low", "high")
    coding = coding.set_axis(paper.text("table11_coding", "factor").factor)
    ends = {"X": claim.part, "Y": {"low": "high", "high": "low"}[claim.part], "Z": claim.part}
    table = _path(paper)
    same = [np.isclose(table[axis], coding.loc[axis, end]) for axis, end in ends.items()]
    match = table.level[np.all(same, axis=0)]
    said = table[table.level == claim.number().value]
    span = ", ".join(f"{axis} {said[axis].iloc[0]:g}" for axis in ASCENT) if len(said) else ""
    value = int(match.iloc[0]) if len(match) else "none"
    return Found(value, names={"span": span or "no level"})
