"""Tables 5, 6, 7 and 10: the screening and the steepest ascent."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from calibration.statistics.screening import Screening, screen
from paper.audit.fits import by_source
from paper.audit.paper import Claim, Paper
from paper.audit.printed import Printed
from paper.audit.verdict import Recomputed, claim_check, number, table_check

FACTORS = tuple("ABCDEFG")
ASCENT = {
    "X": "salt_salt_rolling_friction",
    "Y": "salt_salt_restitution",
    "Z": "salt_steel_rolling_friction",
}


def design(paper: Paper) -> pd.DataFrame:
    """The Plackett-Burman design, coded, with its angles."""
    return paper.numbers("table06_plackett_burman", *FACTORS, "angle_deg")


def screening(paper: Paper) -> Screening:
    """Main effects of the Plackett-Burman design."""
    table = design(paper)
    return screen(table, list(FACTORS), table.angle_deg)


def _ranges(paper: Paper) -> pd.DataFrame:
    table = paper.numbers("table05_contact_parameter_ranges", "low", "high")
    return table.set_axis(paper.text("table05_contact_parameter_ranges", "factor", "name").name)


def _letter(paper: Paper, name: str) -> str:
    table = paper.text("table05_contact_parameter_ranges", "factor", "name")
    return dict(zip(table["name"], table.factor, strict=True))[name]


@claim_check("table05.twice")
def twice(paper: Paper, claim: Claim) -> Recomputed:
    ratios = (_ranges(paper).high / _ranges(paper).low).round(6)
    return Recomputed(
        int((ratios == 2).sum()),
        disagrees=f"High over low is {', '.join(f'{r:.2f}' for r in ratios)} (A to G): effects "
        f"measured over such "
        "unlike ranges cannot be compared per unit of the parameter.",
    )


@claim_check("table06.orthogonal")
def orthogonal(paper: Paper, claim: Claim) -> Recomputed:
    terms = design(paper)[list(FACTORS)].assign(mean=1.0).to_numpy()
    products = terms.T @ terms
    return Recomputed(
        float(np.abs(products - np.diag(np.diag(products))).max()),
        exact=True,
        disagrees="The effects of Table 7 are confounded with one another.",
    )


@claim_check("table06.coded")
def coded(paper: Paper, claim: Claim) -> Recomputed:
    cells = [x.value for x in paper.printed("table06_printed_levels", "E_printed")]
    odd = sorted({c for c in cells if c not in (-1, 1)})
    shown = ", ".join(f"{c:g}" for c in odd)
    high = _ranges(paper).high["salt_salt_restitution"]
    what = (
        "is the natural high level of Table 5 and stands for +1"
        if odd == [high]
        else "is no level of Table 5"
    )
    return Recomputed(
        sum(c not in (-1, 1) for c in cells),
        disagrees=f"{shown} {what}: coded and natural levels are mixed, and a regression of the "
        f"column as printed "
        "gives a wrong coefficient of E.",
    )


@table_check
def anova_cells(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    anova = by_source(screening(paper).anova)
    table = paper.text(
        "table07_plackett_burman_anova", "source", "sum_sq", "df", "mean_sq", "F", "p"
    )
    for row in table.itertuples(index=False):
        for column in ("sum_sq", "df", "mean_sq", "F", "p"):
            claim = Claim(
                f"table07.{row.source}.{column}",
                "Table 7",
                f"{column} of {row.source}",
                getattr(row, column),
                "",
            )
            yield claim, Recomputed(float(anova.loc[row.source, column]))


@claim_check("table07.highly", "table07.others")
def significant(paper: Paper, claim: Claim) -> Recomputed:
    p = by_source(screening(paper).anova).p[list(FACTORS)]
    chosen = p < 0.01 if claim.id == "table07.highly" else p > 0.05
    found = [f for f in FACTORS if chosen[f]]
    smallest = p[~(p < 0.01)].min()
    return Recomputed(
        " ".join(found),
        holds=set(claim.printed.split()) == set(found),
        agrees=f"The choice of the three factors follows from the runs; the next smallest p is "
        f"{smallest:.3f}.",
        disagrees="The factors carried on to the ascent are not those that the runs single out.",
    )


@claim_check("table07.first")
def largest_p(paper: Paper, claim: Claim) -> Recomputed:
    anova = by_source(screening(paper).anova)
    return Recomputed(float(anova.p[[_letter(paper, name) for name in ASCENT.values()]].max()))


def _ascent(paper: Paper) -> pd.DataFrame:
    return paper.numbers("table10_steepest_ascent", "level", "X", "Y", "Z", "angle_deg")


@table_check
def ascent_errors(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    target = paper.value("measured_angle_of_repose")
    printed = paper.printed("table10_steepest_ascent", "relative_error_printed")
    for row, cell in zip(_ascent(paper).itertuples(), printed, strict=True):
        claim = Claim(
            f"table10.error.{row.level:.0f}",
            "Table 10",
            f"Relative error of level {row.level:.0f}",
            cell.text,
            "1",
        )
        yield claim, Recomputed(abs(row.angle_deg - target) / target)


@claim_check("ascent.start")
def ascent_start(paper: Paper, claim: Claim) -> dict[str, Recomputed]:
    centres, found = _ranges(paper).mean(axis=1), {}
    for axis, name in ASCENT.items():
        found[axis] = Recomputed(
            float(centres[name]),
            exact=True,
            printed=paper.printed("table10_steepest_ascent", axis)[0].text,
            disagrees="The ascent does not start where the screening measured its slopes.",
        )
    return found


@claim_check("ascent.step_y", "ascent.step_z")
def ascent_step(paper: Paper, claim: Claim) -> Recomputed:
    """The step of an axis that goes with X's when both follow the screening's coefficients per
    coded unit."""
    axis = claim.id[-1].upper()
    slope = screening(paper).table.set_index("code").effect / 2
    half = (_ranges(paper).high - _ranges(paper).low) / 2
    x, name = ASCENT["X"], ASCENT[axis]
    step_x = float(_ascent(paper).X.diff().iloc[1])
    step = step_x / half[x] * slope[_letter(paper, name)] / slope[_letter(paper, x)] * half[name]
    printed = _step(paper.printed("table10_steepest_ascent", axis))
    return Recomputed(
        float(step),
        printed=printed.text,
        disagrees=f"{axis} moves {abs(printed.value / step):.1f} times as far as steepest ascent "
        f"asks: the path is "
        "not the steepest one, and the optimum found along it depends on that choice.",
    )


def _step(cells: list[Printed]) -> Printed:
    """The first step down a column, printed to the column's finest digit."""
    decimals = max(len(x.text.partition(".")[2]) for x in cells)
    parsed = Printed.parse(f"{cells[1].value - cells[0].value:.{decimals}f}")
    assert parsed is not None
    return parsed


@claim_check("ascent.best")
def ascent_best(paper: Paper, claim: Claim) -> Recomputed:
    table = _ascent(paper)
    error = (table.angle_deg - paper.value("measured_angle_of_repose")).abs()
    target = paper.angles().angle_deg.mean()
    gaps = (
        np.diff(np.sort((table.angle_deg - t).abs()))[0]
        for t in (paper.value("measured_angle_of_repose"), target)
    )
    printed_gap, gap = gaps
    return Recomputed(
        int(table.level[error.idxmin()]),
        agrees=f"It is {printed_gap:.2f} deg nearer to the printed target than the next level, and "
        f"{gap:.2f} deg to "
        "the mean of Table 1: the runs' scatter could turn this choice.",
    )


@claim_check("ascent.low", "ascent.high")
def ascent_levels(paper: Paper, claim: Claim) -> Recomputed:
    """The level of Table 10 whose values the coding of Table 11 uses. X gives the direction (Y
    falls as X rises)."""
    end = claim.id.split(".")[1]
    coding = paper.numbers("table11_coding", "low", "high").set_axis(
        paper.text("table11_coding", "factor").factor
    )
    table = _ascent(paper)
    wanted = {
        "X": coding.loc["X", end],
        "Y": coding.loc["Y", {"low": "high", "high": "low"}[end]],
        "Z": coding.loc["Z", end],
    }
    match = table.level[
        np.all([np.isclose(table[axis], value) for axis, value in wanted.items()], axis=0)
    ]
    said = table[table.level == number(claim).value]
    span = (
        ", ".join(f"{axis} {said[axis].iloc[0]:g}" for axis in ASCENT) if len(said) else "no level"
    )
    return Recomputed(
        int(match.iloc[0]) if len(match) else "none",
        disagrees=f"Table 11's coding is that of another level than the text's ({span}): follow "
        f"the coding.",
    )
