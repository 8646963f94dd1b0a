"""The reproduction table: every table and equation of the paper, its value, ours with its spread, and the agreement."""

import pandas as pd

from calibration.errors import CalibrationError
from calibration.files import write_table
from dem.io.files import write_json
from paper.audit.paper import Paper
from paper.reproduction import bench, chain, measured, screening, theory
from paper.reproduction.rows import AGREES, COLUMNS, DISAGREES, Place, overall
from paper.reproduction.study import Study

PAPER = "data/paper"
ORDER = (
    *(f"Eq. {n}" for n in range(1, 16)), "1.2", "Table 1", "Table 2", "Eq. 16", "Table 3", "Table 4", "Table 5",
    "Table 6", "Table 7", "Eq. 20", "Table 8", "Eq. 21", "Eq. 22", "Table 9", "Eq. 23",
    *(f"Eq. {n}" for n in range(24, 28)), "Table 10", "Table 11", "Eq. 28", "Table 12", "3.1", "Table 13", "3.2",
)  # fmt: skip
"""Items in the order of the paper."""
WHOLE = {"Table 6": "deg", "Table 8": "deg", "Table 9": "mm", "Table 10": "deg", "Table 11": "deg"}
"""Tables of simulated values, and their unit."""


def reproduce(folders, config, paper=PAPER):
    """The reproduction table from what the stages of the studies in `folders` have left; the first is the main one.

    Returns a DataFrame with columns `rows.COLUMNS`, a row a value; stages that have not run give rows that say so.
    Raises AuditInputError for an incomplete folder of printed tables, CalibrationError for two rows of one id.
    """
    printed, studies = Paper(paper), [Study(f) for f in folders]
    rows = [
        *theory.rows(printed, studies[0]),
        *measured.rows(printed, config),
        *screening.rows(printed, studies[0]),
        *bench.rows(printed, studies[0]),
        *chain.rows(printed, studies),
    ]
    rows += [_whole(item, unit, rows, studies[0].name) for item, unit in WHOLE.items()]
    rows.sort(key=lambda row: ORDER.index(row["item"]))
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    repeated = sorted(set(table["id"][table["id"].duplicated()]))
    if repeated:
        raise CalibrationError(
            f"two rows of the reproduction table have the id {', '.join(repeated)}"
        )
    return table


def _whole(item, unit, rows, study):
    """The row that says how a table of simulated values does as a whole; counts only its values in `unit`."""
    parts = [row for row in rows if row["item"] == item and row["unit"] == unit]
    names = {row["study"] for row in parts if row["study"]} or {study}
    place = Place(
        item, f"{item.lower().replace(' ', '')}.whole", "all values", "1", min(names), True
    )
    return overall(place, parts)


def counts(table):
    """One line: how many rows agree, disagree and are not compared."""
    n = table["agreement"].value_counts()
    parts = [f"{n.get(word, 0)} {word.removesuffix('s')}" for word in (AGREES, DISAGREES)]
    rest = [f"{k} {word}" for word, k in n.items() if word not in (AGREES, DISAGREES)]
    return f"{len(table)} values: {', '.join(parts + rest)}."


def write_reproduction(table, csv, json):
    """Write the table atomically, as CSV and as JSON with its counts."""
    write_table(table, csv)
    rows = table.astype(object).where(table.notna(), None).to_dict("records")
    write_json(json, {"counts": counts(table), "rows": rows})
