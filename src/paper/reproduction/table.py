"""The reproduction table: what the paper found by simulation and by its bench tests, ours with its
spread, and the agreement. What follows from the paper's own figures is in the audit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from calibration.files import write_table
from calibration.statistics.equivalence import DIFFERENT, EQUIVALENT, UNDECIDABLE, UNDECIDED
from dem.io.files import write_json
from paper.audit.paper import TABLES, Paper
from paper.reproduction import bench, chain, scaling, screening
from paper.reproduction.rows import COLUMNS, IN_TABLE, Place, by_unit, whole
from paper.reproduction.study import Study

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study as CalibratedStudy

PAPER = "data/paper"
ORDER = (
    "Eq. 15", "1.2", "Table 6", "Table 7", "Table 8", "Eq. 21", "Table 9", "Eq. 23", "Eq. 26",
    "Eq. 27", "Table 10", "Table 11", "Eq. 28", "Table 12", "3.1", "Table 13", "3.2",
)  # fmt: skip
"""Items in the order of the paper."""


def reproduction(study: CalibratedStudy, source: NamedFiles, output: NamedFiles) -> None:
    """Set the paper's results beside this study's values, and those of the studies beside it, as
    the workflow calls it."""
    others = [Path(path).parents[1] for path in source.beside]
    repeats = list(dict.fromkeys(Path(path).parents[1] for path in source.repeats))
    table = reproduce([study.folder, *others], repeats=repeats)
    write_reproduction(table, output.table, output.summary)


def reproduce(
    folders: Sequence[str | Path],
    paper: str | Path = PAPER,
    repeats: Iterable[str | Path] = (),
) -> pd.DataFrame:
    """The reproduction table from what the stages of the studies in `folders` have left; the first
    is the main one. repeats: folders of the same study at other seeds.

    Returns a DataFrame with columns `rows.COLUMNS`, a row a value; stages that have not run give
    rows that say so. Raises AuditInputError for an incomplete folder of printed tables.
    """
    printed, studies = Paper(paper), [Study(f) for f in folders]
    studies[0].repeats = tuple(Study(f) for f in repeats)
    rows = [
        *scaling.rows(studies[0]),
        *screening.rows(printed, studies[0], studies[0].repeats),
        *bench.rows(printed, studies[0]),
        *chain.rows(printed, studies),
    ]
    rows += [_whole(item, table.unit, rows, studies[0]) for item, table in TABLES.items()]
    rows.sort(key=lambda row: ORDER.index(row["item"]))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _whole(item, unit, rows, study):
    """The row about a table of simulated values as a whole, of its values in `unit`."""
    parts = [row for row in rows if row["item"] == item and row["agreement"] == IN_TABLE]
    name = min({row["study"] for row in parts if row["study"]} or {study.name})
    values = [abs(float(row["paper"])) for row in parts]
    margin = by_unit(unit, sum(values) / len(values) if values else 0.0)
    key = item.lower().replace(" ", "")
    text = f"difference of {len(values)} values beyond the runs' scatter (root mean square)"
    return whole(Place(item, f"{key}.whole", text, unit, name, True), parts, margin)


def counts(table: pd.DataFrame) -> str:
    """How many rows there are, and how many with each verdict."""
    n = table["agreement"].value_counts()
    verdicts = (EQUIVALENT, DIFFERENT, UNDECIDED, UNDECIDABLE)
    each = [f"{n[w]} {w}" for w in (*verdicts, *n.index.difference(verdicts)) if w in n]
    return f"{len(table)} rows: {', '.join(each)}."


def write_reproduction(table: pd.DataFrame, csv: str | Path, json: str | Path) -> None:
    """Write the table atomically, as CSV and as JSON with its counts."""
    write_table(table, csv)
    rows = table.astype(object).where(table.notna(), None).to_dict("records")
    write_json(json, {"counts": counts(table), "rows": rows})
