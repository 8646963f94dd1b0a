"""The stage `audit`: every check over one folder of printed tables, and its files."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pandas as pd

from calibration.files import write_text
from paper.audit import (  # noqa: F401  (importing a module registers its checks)
    bench,
    materials,
    screening,
    surface,
    theory,
)
from paper.audit.evaluate import (
    CELLS,
    CHECKS,
    DISAGREES,
    NOT_COMPUTABLE,
    USUAL,
    Found,
    cell_claims,
    judge,
)
from paper.audit.paper import AuditInputError, Claim, Paper

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
