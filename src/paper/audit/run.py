"""The stage `audit`: every check over one folder of printed tables."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pandas as pd

from paper.audit import (  # noqa: F401  (importing a module registers its checks)
    bench,
    intrinsic,
    numerics,
    references,
    response_surface,
    screening,
    theory,
    validation,
)
from paper.audit.paper import AuditInputError, Claim, Paper
from paper.audit.verdict import CLAIM_CHECKS, TABLE_CHECKS, Recomputed, judge

COLUMNS = (
    "id",
    "where",
    "claim",
    "printed",
    "recomputed",
    "unit",
    "tolerance",
    "verdict",
    "consequence",
)

ORDER = (
    "section11 eq4 eq5 eq6 eq2 eq8 section121 eq9 eq15 section122 table01 table02 table03 heap "
    "table04 table05 table06 "
    "table07 table08 eq21 tilt table09 eq23 drop shear table10 ascent section235 table11 eq28 "
    "table12 model "
    "interaction fig9a fig9b conclusion optimum table13 validation labels reference"
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
    rows.sort(key=lambda row: _place(str(row["id"])))
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    repeated = table.id[table.id.duplicated()]
    if len(repeated):
        raise AuditInputError(
            "two rows give the id", path=paper.folder, key=", ".join(sorted(set(repeated)))
        )
    return table


def _place(claim_id: str) -> int:
    part = claim_id.split(".")[0]
    return ORDER.index(part) if part in ORDER else len(ORDER)


def _findings(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    unknown = set(paper.claims) ^ set(CLAIM_CHECKS)
    if unknown:
        raise AuditInputError(
            "claims and checks differ", path=paper.folder / "claims.csv",
            key=", ".join(sorted(unknown)),
        )  # fmt: skip
    for claim in paper.claims.values():
        found = CLAIM_CHECKS[claim.id](paper, claim)
        if isinstance(found, Recomputed):
            yield claim, found
            continue
        for suffix, part in found.items():
            yield replace(claim, id=f"{claim.id}.{suffix}", claim=f"{claim.claim} ({suffix})"), part
    for check in TABLE_CHECKS:
        yield from check(paper)
