"""The reproduction table: what the paper found by simulation and by its bench tests, ours with its
spread, and the agreement. What follows from the paper's own figures is in the audit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd
from scipy import stats

from calibration.files import write_table
from calibration.statistics.equivalence import DIFFERENT, EQUIVALENT, UNDECIDABLE, UNDECIDED, Error
from dem.io.files import write_json
from paper.audit.paper import TABLES, Paper, printed_number
from paper.reproduction import bench, chain
from paper.reproduction import rows as r
from paper.reproduction.rows import Place
from paper.reproduction.study import Study

if TYPE_CHECKING:
    from calibration.chain.study import NamedFiles
    from calibration.chain.study import Study as CalibratedStudy


PAPER = "data/paper"
ORDER = (
    "Eq. 15", "1.2", "Table 6", "Table 7", "Table 8", "Eq. 21", "Table 9", "Eq. 23", "Eq. 26",
    "Eq. 27", "Table 10", "Table 11", "Eq. 28", "Table 12", "3.1", "Table 13", "3.2",
)  # fmt: skip
"""Items in the order of the paper."""


def reproduction(study: CalibratedStudy, source: NamedFiles, output: NamedFiles) -> None:
    """Set the paper's results beside this study's values, and those of the studies beside it, as
    CSV and as JSON with its counts."""
    others = [Path(path).parents[1] for path in source.beside]
    repeats = list(dict.fromkeys(Path(path).parents[1] for path in source.repeats))
    table = reproduce([study.folder, *others], repeats=repeats)
    write_table(table, output.table)
    rows = table.astype(object).where(table.notna(), None).to_dict("records")
    write_json(output.summary, {"counts": counts(table), "rows": rows})


def reproduce(folders: Sequence[str | Path], repeats: Iterable[str | Path] = ()) -> pd.DataFrame:
    """The reproduction table from what the stages of the studies in `folders` have left; the first
    is the main one. repeats: folders of the same study at other seeds.

    Returns a DataFrame with columns `rows.COLUMNS`, a row a value; stages that have not run give
    rows that say so. Raises AuditInputError for an incomplete folder of printed tables.
    """
    printed, studies = Paper(PAPER), [Study(f) for f in folders]
    studies[0].repeats = tuple(Study(f) for f in repeats)
    rows = [*_scaling(studies[0]), *bench.rows(printed, studies[0]), *chain.rows(printed, studies)]
    rows += [r.whole(item, table.unit, rows, studies[0].name) for item, table in TABLES.items()]
    rows.sort(key=lambda row: ORDER.index(row["item"]))
    return pd.DataFrame(rows, columns=list(r.COLUMNS))


VERDICTS = {"holds": EQUIVALENT, "fails": DIFFERENT, "undecided": UNDECIDED}
CLAIMS = "config/reference.yaml makes these runs; results/reference/salt has a release's"
ENLARGED = "The angle of repose does not change with the scale"
TWICE = 2.0
"""The enlargement that the paper made (1.2.2): salt of 1 mm as grains of 2 mm."""


def _scaling(study):
    """A row a statement of Section 1.2 that the scaling study judged by runs."""
    summary = study.summary("scaling")
    if summary is None:
        place = study.place("1.2", "heap.paper.plain.twice", ENLARGED, "deg")
        yield r.row(place, CLAIMS, "0.0", agreement=r.NOT_RUN)
        return
    responses = study.table("scaling", "scaling")
    for statement in summary["statements"]:
        kind = statement["id"].split(".")[0]
        if kind == "section122":
            yield _statement(statement, study.name)
        elif kind in r.SCALING:
            yield from _over_scales(statement, responses, study.name)


def _statement(statement, study):
    place = Place("Eq. 15", statement["id"], statement["statement"], "1", study)
    printed, found, paper, numbers = statement["printed"], statement["found"], None, {}
    if found is not None:
        ends = {end: statement[end] - printed for end in ("low", "high")}
        paper, numbers = f"{printed:g}", ends | {"difference": found - printed}
    agreement = VERDICTS[statement["verdict"]]
    return r.row(place, statement["sentence"], paper, found, agreement, **numbers)


def _over_scales(statement, responses, study):
    """Rows of a quantity that is said not to change with the scale: when grain and rig are doubled,
    and over the whole range of scales; responses: the table of the scaling study."""
    name, said, basis = statement["id"], statement["statement"], statement["sentence"]
    experiment, rule, kind = name.split(".")
    named = responses[["experiment", "rule", "cohesive"]] == [experiment, rule, kind == "cohesive"]
    case = responses[named.all(axis=1)]
    unit, digits, none = ("deg", 2, "0.0") if experiment == "heap" else ("1", 4, "0.000")
    margin, none, runs = r.SCALING[experiment], printed_number(none), int(case["n"].sum())
    place = Place("1.2", name, f"{said}, over the whole range", unit, study)
    if statement["found"] is None:
        yield r.row(place, basis, "0", agreement=r.NO_NUMBER)
    else:
        freedom = max(runs - 2, 1)
        reach = 0.5 * (statement["high"] - statement["low"])
        own = Error(reach / float(stats.t.ppf(0.975, freedom)), freedom, runs)
        yield r.estimates(place, none, statement["found"], own, margin=margin) | {"basis": basis}
    first, twice = (case[case["scale"] == h] for h in (case["scale"].min(), TWICE))
    if len(twice) and len(first) and min(twice["n"].iloc[0], first["n"].iloc[0]) > 1:
        text = f"{said}, when doubled as the paper did"
        place = Place("1.2", f"{name}.twice", text, unit, study, experiment == "heap")
        yield _doubled(place, none, first.iloc[0], twice.iloc[0], margin, digits)


def _doubled(place, none, first, twice, margin, digits):
    """Row of the change from the first scale to the second, by Welch's interval."""
    one, two = (Error(x["sd"] / math.sqrt(x["n"]), x["n"] - 1) for x in (first, twice))
    se, freedom = two.beside(one)
    own = Error(se, freedom, int(first["n"] + twice["n"]))
    row = r.estimates(place, none, twice["mean"] - first["mean"], own, margin=margin)
    ends = ", ".join(
        f"{x['mean']:.{digits}f} at scale {x['scale']:g} ({int(x['n'])} runs)"
        for x in (first, twice)
    )
    return row | {"basis": f"{ends}; Welch interval"}


def counts(table: pd.DataFrame) -> str:
    """How many rows there are, and how many with each verdict."""
    n = table["agreement"].value_counts()
    verdicts = (EQUIVALENT, DIFFERENT, UNDECIDED, UNDECIDABLE)
    each = [f"{n[w]} {w}" for w in (*verdicts, *n.index.difference(verdicts)) if w in n]
    return f"{len(table)} rows: {', '.join(each)}."
