"""Recompute every printed figure of the paper from its printed tables and say which agree.

Each module of a part of the paper has a table CLAIMS, claim of claims.csv -> what the printed
tables give for it, and a table CELLS of the claims that the cells of tables make. This is the one
evaluator."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from calibration.engines.templates import macros
from calibration.files import write_text
from paper.audit import bench, materials, screening, surface, theory
from paper.audit.paper import AuditInputError, Claim, Found, Paper

if TYPE_CHECKING:
    from calibration.chain.study import NamedFiles, Study

MODULES = (bench, materials, screening, surface, theory)
CLAIMS = {i: give for m in MODULES for ids, give in m.CLAIMS.items() for i in ids.split()}
CELLS = {key: cells for m in MODULES for key, cells in m.CELLS.items()}
AGREES, DISAGREES, NOT_COMPUTABLE = "agrees", "disagrees", "not_computable"
USUAL = {AGREES: "None: the printed figure stands.", DISAGREES: "Use the recomputed figure."}
COLUMNS = (
    "id", "where", "claim", "printed", "recomputed", "unit", "tolerance", "verdict", "consequence",
)  # fmt: skip
HEAD = {name: name for name in COLUMNS if name != "tolerance"} | {"claim": "statement"}
ORDER = (
    "section11 eq4 eq5 eq6 eq2 eq8 section121 eq9 eq10 eq11 eq14 eq15 section122 table01 "
    "table02 table03 heap table04 table05 table06 table07 table08 eq21 tilt table09 eq23 drop "
    "shear table10 ascent section235 table11 eq28 table12 model interaction fig9a fig9b "
    "conclusion optimum table13 validation labels reference"
).split()
"""First parts of the claims' ids in the order of the paper."""


def audit(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Recompute every printed figure of the paper, as the workflow calls it."""
    write_audit(run_audit(Path(source.tables[0]).parent), output.table, output.page)


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
    AuditInputError : a missing file, column or row, a cell that is no number, a claim that no
    module knows
    """
    paper = Paper(folder)
    rows = [_judged(claim, found) for claim, found in _findings(paper)]
    rows.sort(key=lambda row: ORDER.index(row["id"].split(".")[0]))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _findings(paper: Paper) -> Iterator[tuple[Claim, Found]]:
    unknown = set(paper.claims) ^ set(CLAIMS)
    if unknown:
        raise AuditInputError(
            "claims and checks differ", path=paper.folder / "claims.csv",
            key=", ".join(sorted(unknown)),
        )  # fmt: skip
    for claim in paper.claims.values():
        found = CLAIMS[claim.id](paper, claim)
        if not isinstance(found, dict):
            yield claim, _as_found(found)
            continue
        for end, part in found.items():
            yield replace(claim, id=f"{claim.id}.{end}", claim=f"{claim.claim} ({end})"), part
    told = paper.text("cell_claims", "id", "where", "claim", "unit", *USUAL).set_index("id")
    for key, (rows, columns, judge) in CELLS.items():
        sentences = {verdict: told.loc[key, verdict] for verdict in USUAL}
        listed = paper.text(rows).to_dict("records") if isinstance(rows, str) else rows(paper)
        for k, row in enumerate(listed, start=1):
            for cell in columns.split():
                found = _as_found(judge(paper, row | {"row": k, "cell": cell}))
                if not row[cell] and pd.isna(found.value):
                    continue  # as F of a residual
                found.names = row | {"row": k, "cell": cell} | found.names
                texts = [key, *told.loc[key, ["where", "claim", "unit"]]]
                ident, where, claim, unit = (text.format(**found.names) for text in texts)
                yield Claim(ident, where, claim, row[cell], unit, sentences), found


def _as_found(given):
    return given if isinstance(given, Found) else Found(given)


def _judged(claim: Claim, found: Found) -> dict[str, Any]:
    """Return one row of the audit."""
    text = claim.printed if found.printed is None else found.printed
    holds, tolerance = found.compared(text)
    verdict = NOT_COMPUTABLE if found.value is None else AGREES if holds else DISAGREES
    told = claim.sentences.get("unknown" if found.value is None else verdict, "")
    names = found.names | {"value": found.value, "printed": text, "unit": claim.unit}
    return {
        "id": claim.id, "where": claim.where, "claim": claim.claim, "printed": text,
        "recomputed": found.value, "unit": claim.unit, "tolerance": tolerance, "verdict": verdict,
        "consequence": told.format(**names) if told else USUAL.get(verdict, ""),
    }  # fmt: skip


def write_audit(table: pd.DataFrame, csv: str | Path, html: str | Path) -> None:
    """Write the audit, a table as of `run_audit`, as CSV and as a page."""
    shown = table.map(_shown)
    write_text(shown.to_csv(index=False), csv)
    rows = shown[list(HEAD)].rename(columns=HEAD).to_html(index=False, border=0)
    for verdict in (DISAGREES, NOT_COMPUTABLE):
        rows = rows.replace(f"<td>{verdict}</td>", f'<td class="{verdict}">{verdict}</td>')
    n = table.verdict.value_counts()
    counts = [f"{n.get(v, 0)} {v.replace('_', ' ')}" for v in (*USUAL, NOT_COMPUTABLE)]
    write_text(macros("paper.audit", "audit.html").page(len(table), counts, rows), html)


def _shown(value):
    if value is None or (isinstance(value, float) and pd.isna(value)):
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
