"""The one evaluator: from what the checks compute to a table of verdicts, and the files of it.

A check of a claim of claims.csv gives a value, a `Found`, or {end of the id: Found} where a claim
stands for several rows. A check of a table's cells yields (row of cell_claims.csv, printed text,
`Found`). The names in `Found.names` fill the ids and sentences of both files."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.files import write_text
from paper.audit.paper import SENTENCES, AuditInputError, Claim, Paper, Printed

AGREES, DISAGREES, NOT_COMPUTABLE = "agrees", "disagrees", "not_computable"
USUAL = {AGREES: "None: the printed figure stands.", DISAGREES: "Use the recomputed figure."}
COLUMNS = (
    "id", "where", "claim", "printed", "recomputed", "unit", "tolerance", "verdict", "consequence",
)  # fmt: skip
HEAD = {name: name for name in COLUMNS if name != "tolerance"} | {"claim": "statement"}
ORDER = (
    "section11 eq4 eq5 eq6 eq2 eq8 section121 eq9 eq15 section122 table01 table02 table03 heap "
    "table04 table05 table06 "
    "table07 table08 eq21 tilt table09 eq23 drop shear table10 ascent section235 table11 eq28 "
    "table12 model "
    "interaction fig9a fig9b conclusion optimum table13 validation labels reference"
).split()
"""First parts of the claims' ids in the order of the paper."""


@dataclass(frozen=True)
class Found:
    """What the tables give for a claim.

    value : number, text, or None where the printed tables do not determine it
    half_width : what the rounding of printed inputs adds to the tolerance, in the claim's unit
    exact : a setting or an exponent, which has no rounding; an int, a count, is always exact
    holds : whether the claim holds, where that is not equality with `value` within the tolerance
    printed : the printed text, where it stands in a table and not in claims.csv
    names : what the claim's id and sentences are filled with, beside value, printed and unit
    """

    value: float | str | None
    half_width: float = 0.0
    exact: bool = False
    holds: bool | None = None
    printed: str | None = None
    names: Mapping[str, Any] = field(default_factory=dict)


Check = Callable[[Paper, Claim], Any]
Cells = Callable[[Paper], Iterator[tuple[str, str, Found]]]
CHECKS: dict[str, Check] = {}
"""Checks of the claims of claims.csv by id."""
CELLS: list[Cells] = []
"""Checks of the cells of tables."""


def check(*ids: str) -> Callable[[Check], Check]:
    """Register a check for the claims `ids`."""

    def register(function: Check) -> Check:
        CHECKS.update(dict.fromkeys(ids, function))
        return function

    return register


def cells(function: Cells) -> Cells:
    """Register a check of a table's cells."""
    CELLS.append(function)
    return function


def run_audit(folder: str | Path) -> pd.DataFrame:
    """Recompute every printed figure of the paper.

    Parameters
    ----------
    folder : the printed tables, laid out as data/paper

    Returns
    -------
    DataFrame, a row a claim, columns `COLUMNS`. `tolerance` is half a unit in the last printed
    place plus what the rounding of printed inputs adds, in the claim's unit. It is empty if the
    verdict is no such comparison. `verdict` is agrees, disagrees or not_computable.

    Raises
    ------
    AuditInputError : a missing file, column or row, a cell that is no number, a claim that no check
    knows
    """
    paper = Paper(folder)
    rows = [judge(claim, found) for claim, found in _findings(paper)]
    rows.sort(key=lambda row: ORDER.index(row["id"].split(".")[0]))
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    repeated = table.id[table.id.duplicated()]
    if len(repeated):
        raise AuditInputError(
            "two rows give the id", path=paper.folder, key=", ".join(sorted(set(repeated)))
        )
    return table


def _findings(paper: Paper) -> Iterator[tuple[Claim, Found]]:
    unknown = set(paper.claims) ^ set(CHECKS)
    if unknown:
        raise AuditInputError(
            "claims and checks differ", path=paper.folder / "claims.csv",
            key=", ".join(sorted(unknown)),
        )  # fmt: skip
    for claim in paper.claims.values():
        found = CHECKS[claim.id](paper, claim)
        if not isinstance(found, dict):
            yield claim, found if isinstance(found, Found) else Found(found)
            continue
        for end, part in found.items():
            yield replace(claim, id=f"{claim.id}.{end}", claim=f"{claim.claim} ({end})"), part
    for function in CELLS:
        yield from cell_claims(paper, function)


def cell_claims(paper: Paper, function: Cells) -> Iterator[tuple[Claim, Found]]:
    """Yield the claims of a check of a table's cells, with what it found."""
    rows = paper.text("cell_claims", "id", "where", "claim", "unit", *SENTENCES[:2]).set_index("id")
    for key, printed, found in function(paper):
        row = rows.loc[key]
        filled = {k: row[k].format(**found.names) for k in ("where", "claim", "unit")}
        sentences = {name: row[name] for name in SENTENCES[:2]}
        yield (
            Claim(key.format(**found.names), printed=printed, sentences=sentences, **filled),
            found,
        )


def judge(claim: Claim, found: Found) -> dict[str, Any]:
    """Return one row of the audit."""
    text = claim.printed if found.printed is None else found.printed
    value = found.value.item() if isinstance(found.value, np.generic) else found.value
    printed = Printed.parse(text)
    holds, tolerance = found.holds, None
    if value is not None and holds is None:
        if printed is not None and not isinstance(value, str):
            holds, tolerance = _compare(printed, float(value), found)
        else:
            holds = text.strip() == str(value).strip()
    verdict = NOT_COMPUTABLE if value is None else AGREES if holds else DISAGREES
    told = claim.sentences.get("unknown" if value is None else verdict, "")
    names = {"value": value, "printed": text, "unit": claim.unit} | dict(found.names)
    return {
        "id": claim.id, "where": claim.where, "claim": claim.claim, "printed": text,
        "recomputed": value, "unit": claim.unit, "tolerance": tolerance, "verdict": verdict,
        "consequence": told.format(**names) if told else USUAL.get(verdict, ""),
    }  # fmt: skip


def _compare(printed, value, found):
    """Whether a number agrees with the printed one, and the tolerance used."""
    if printed.relation:
        return (value < printed.value if printed.relation == "<" else value > printed.value), None
    exact = found.exact or isinstance(found.value, int)
    tolerance = 0.0 if exact else printed.half_unit + found.half_width
    # A decimal half unit is not exact in binary: allow it its last bits.
    slack = 1e-9 * max(abs(printed.value), tolerance)
    return abs(value - printed.value) <= tolerance + slack, tolerance


def write_audit(table: pd.DataFrame, *paths: str | Path) -> None:
    """Write the audit to each of `paths`, the suffix choosing the form: .csv or .html.

    `table` is `run_audit`'s. Raises ValueError for another suffix, before anything is written.
    """
    shown = table.map(_shown)
    texts = {".csv": lambda: shown.to_csv(index=False), ".html": lambda: _page(table, shown)}
    targets = [Path(path) for path in paths]
    for target in targets:
        if target.suffix not in texts:
            raise ValueError(f"{target}: the suffix must be one of {', '.join(texts)}")
    for target in targets:
        write_text(texts[target.suffix](), target)


def _shown(value):
    if value is None or (isinstance(value, float) and pd.isna(value)):
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _page(table, shown):
    n = table.verdict.value_counts()
    counts = ", ".join(f"{n.get(v, 0)} {v.replace('_', ' ')}" for v in USUAL | {NOT_COMPUTABLE: ""})
    rows = shown[list(HEAD)].rename(columns=HEAD).to_html(index=False, border=0)
    for verdict in (DISAGREES, NOT_COMPUTABLE):
        rows = rows.replace(f"<td>{verdict}</td>", f'<td class="{verdict}">{verdict}</td>')
    style = (
        "body{font:14px sans-serif}table{border-collapse:collapse}"
        "td,th{border:1px solid #ccc;padding:3px 6px;text-align:left;vertical-align:top}"
        ".disagrees{background:#fbe3df}.not_computable{background:#eee}"
    )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>Audit</title>'
        f"<style>{style}</style></head>\n<body><h1>Audit of the printed figures</h1>"
        f"<p>{len(table)} claims: {counts}.</p>\n{rows}\n</body></html>\n"
    )
