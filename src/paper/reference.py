"""Keeps the results of a finished study under results/reference/ and writes them beside the
paper's: six rows into the README, and all that matter into docs/results.md.

python -m paper.reference results/salt
"""

import sys
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.errors import CalibrationError
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_values
from calibration.statistics.equivalence import UNDECIDABLE, UNDECIDED
from calibration.statistics.numbers import fixed, spread
from calibration.telling.kept_results import KEPT, keep, put
from paper.reproduction.table import counts

BEGIN, END = "<!-- results: begin -->", "<!-- results: end -->"
SHORT = {
    "table13.mean.{study}": ("validated angle of repose [°]; measured {measured}",
    "the paper's runs scatter too much"),
    "table07.G.effect": ("effect on it of rolling friction, salt on salt [°]",
    "the paper's runs scatter too much"),
    "tilt.inverse": ("static friction, salt on steel, from the tilted plane",
    "the paper's slides scatter too much"),
    "drop.inverse": ("restitution, salt on steel, from the drop",
    "the paper's drops scatter too much"),
    "shear.slope": ("slope of the yield locus", "the paper prints one locus and no scatter"),
    "heap.paper.plain.twice": ("change of the angle when grain and rig are doubled, as in the "
    "paper [°]", ""),
}  # fmt: skip
"""Rows of the README: id, where the study's name may stand; words, where the measured mean may
stand; and why no number of our runs decides it, where none does."""
METRIC = "angle_of_repose_deg"
README, PAGE = Path("README.md"), Path("docs/results.md")
TABLE = Path("reproduction") / "reproduction.csv"
FUNNELS = "funnels.csv"
TABLES = ("reproduction.csv", "disagreement.md", "table_*.csv")
"""What is kept of the stages that concern the paper alone."""
POURED = ("screening", "candidate_first", "candidate", "validation")


def block(table: pd.DataFrame, link: str) -> str:
    """Markdown: the rows of the reproduction table that matter most, the counts of all rows, and
    the `link` to them. Rows of a further study name it."""
    study = Path(link).parent.parent.name
    head = ("", "", "paper (EDEM)", "this project", "difference, 90 %", "margin", "agreement")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for row in table[table["headline"]].itertuples():
        quantity = row.quantity if row.unit == "1" else f"{row.quantity} [{row.unit}]"
        if row.study not in ("", study) and not pd.isna(row.study):
            quantity += f", {row.study}"
        paper = "" if pd.isna(row.paper) else str(row.paper)
        cells = (row.item, quantity, paper, _ours(row), *_judged(row), verdict_of(row))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, "", f"All rows, with intervals: [{link}]({link}). {counts(table)}"])


def short_block(table: pd.DataFrame, study: str, measured: float) -> str:
    """Markdown for the README: the six rows of `SHORT`, with intervals; measured: mean [°]."""
    head = ("", "paper (EDEM)", "this project", "difference, 90 %", "verdict")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    rows = table.set_index("id")
    for name, (words, reason) in SHORT.items():
        row_id = name.format(study=study)
        if row_id in rows.index:
            row = rows.loc[row_id]
            words = words.format(measured=fixed(measured, 2))
            cells = (words, str(row.paper), _ours(row), _judged(row)[0], verdict_of(row, reason))
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def verdict_of(row: Any, reason: str = "") -> str:
    """A row's verdict, with the number of further runs that would decide it, or why none would."""
    if row.agreement == UNDECIDED and not pd.isna(row.more_runs):
        return f"{UNDECIDED}: {int(row.more_runs)} more runs"
    if row.agreement == UNDECIDABLE and reason:
        return f"{UNDECIDABLE}: {reason}"
    return row.agreement


def _ours(row):
    """This project's value to a digit more than the paper prints, with its standard deviation where
    it has one."""
    if pd.isna(row.this_project):
        return ""
    try:
        value = float(row.this_project)
    except ValueError:
        return str(row.this_project)
    printed = str(row.paper).partition(".")[2]
    digits = min(len(printed) + 1, 3)
    sd = "" if pd.isna(row.sd) or row.sd == 0 else f" ± {spread(row.sd, digits)}"
    return f"{fixed(value, digits)}{sd}"


def _judged(row):
    """The difference with its interval, and the margin; empty where nothing was computed."""
    if pd.isna(row.low) or pd.isna(row.margin):
        return "", ""
    digits = 3 if row.margin < 0.1 else 2
    low, high, apart = (fixed(x, digits, "+") for x in (row.low, row.high, row.difference))
    return f"{apart} ({low} to {high})", f"{row.margin:.{digits}g}"


def funnels(study: str | Path) -> pd.DataFrame:
    """Table of a study's heaps: stage, run_id, angle of repose [°] and the most grains that stood
    in the funnel at once; empty where a run gave no value. A run of two stages counts once."""
    designs = {s: Path(study) / s / "design.csv" for s in POURED}
    rows = [read_written(p)[["run_id"]].assign(stage=s) for s, p in designs.items() if p.is_file()]
    table = pd.concat(rows, ignore_index=True)[["stage", "run_id"]].drop_duplicates("run_id")
    return table.assign(**{m: read_values(table["run_id"], m) for m in (METRIC, "hold_up")})


def keep_study(study: str | Path, target: str | Path) -> None:
    """Copy a study's summaries and tables, and, where its runs are at hand, what its heaps held."""
    keep(study, target, (*KEPT, *TABLES))
    if (Path(study).parent / "runs").is_dir():
        write_table(funnels(study), Path(target) / FUNNELS)


def main(study: str | Path) -> None:
    """Keep the study's results and put its reproduction table into the README. Raises
    CalibrationError without one."""
    if not (Path(study) / TABLE).is_file():
        raise CalibrationError(
            f"{Path(study) / TABLE}: missing; `snakemake -j2 reproduction` makes it"
        )
    target = Path("results/reference") / Path(study).name
    if Path(study).resolve() != target.resolve():
        keep_study(study, target)
    for page, text in blocks(target).items():
        if page.is_file():
            put(page, text, BEGIN, END)


def blocks(kept: str | Path) -> dict[Path, str]:
    """{page: Markdown between its marks} of the README and the results page, from kept results."""
    kept = Path(kept)
    table = read_written(kept / TABLE, dtype={"paper": str})
    measured = read_json(kept / "validation" / "validation.json")["measured_mean"]
    own = table[table["study"].isna() | table["study"].isin(("", kept.name))]
    return {
        README: short_block(table, kept.name, measured),
        PAGE: block(own, f"../{kept / TABLE}"),
    }


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except CalibrationError as error:
        sys.exit(str(error))
