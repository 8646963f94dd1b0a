"""The one evaluator: from what the checks compute to a table of verdicts, and the files of it.

A check of a claim of claims.csv gives a value, a `Found`, or {end of the id: Found} where a claim
stands for several rows. A check of a table's cells yields (row of cell_claims.csv, printed text,
`Found`). The names in `Found.names` fill the ids and sentences of both files."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from paper.audit.paper import SENTENCES, Claim, Paper, Printed

AGREES, DISAGREES, NOT_COMPUTABLE = "agrees", "disagrees", "not_computable"
USUAL = {AGREES: "None: the printed figure stands.", DISAGREES: "Use the recomputed figure."}


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


Given = Found | dict[str, Found] | float | str | None
"""What a check of a claim gives."""
Cells = Iterator[tuple[str, str, Found]]
"""What a check of the cells of a table yields."""
Check = Callable[[Paper, Claim], Given]
CellCheck = Callable[[Paper], Cells]
CHECKS: dict[str, Check] = {}
"""Checks of the claims of claims.csv by id."""
CELLS: list[CellCheck] = []
"""Checks of the cells of tables."""


def check(*ids: str) -> Callable[[Check], Check]:
    """Register a check for the claims `ids`."""

    def register(function: Check) -> Check:
        CHECKS.update(dict.fromkeys(ids, function))
        return function

    return register


def cells(function: CellCheck) -> CellCheck:
    """Register a check of a table's cells."""
    CELLS.append(function)
    return function


def cell_claims(paper: Paper, function: CellCheck) -> Iterator[tuple[Claim, Found]]:
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
