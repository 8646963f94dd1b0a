"""From a printed claim and what the tables give, the verdict."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from paper.audit.paper import AuditInputError, Claim, Paper
from paper.audit.printed import Printed

AGREES, DISAGREES, NOT_COMPUTABLE = "agrees", "disagrees", "not_computable"


@dataclass(frozen=True)
class Recomputed:
    """What the tables give for a claim.

    value : number, text, or None where the printed tables do not determine it
    half_width : what the rounding of printed inputs adds to the tolerance, in the claim's unit
    exact : a setting or an exponent, which has no rounding; an int, a count, is always exact
    holds : whether the claim holds, where that is not equality with `value` within the tolerance
    printed : the printed text, where it stands in a table and not in claims.csv
    agrees, disagrees, unknown : the consequence for each verdict
    """

    value: float | str | None
    agrees: str = "None: the printed figure stands."
    disagrees: str = "Use the recomputed figure."
    unknown: str = ""
    half_width: float = 0.0
    exact: bool = False
    holds: bool | None = None
    printed: str | None = None


Check = Callable[[Paper, Claim], "Recomputed | Mapping[str, Recomputed]"]
TableCheck = Callable[[Paper], Iterator[tuple[Claim, Recomputed]]]

CLAIM_CHECKS: dict[str, Check] = {}
"""Checks of the claims in claims.csv by id. A mapping stands for several rows, its keys ending
their ids."""
TABLE_CHECKS: list[TableCheck] = []
"""Checks that take their claims from the printed cells of a table."""


def claim_check(*ids: str) -> Callable[[Check], Check]:
    """Register a check for the claims `ids`."""

    def register(check: Check) -> Check:
        CLAIM_CHECKS.update(dict.fromkeys(ids, check))
        return check

    return register


def table_check(check: TableCheck) -> TableCheck:
    """Register a check of a table's cells."""
    TABLE_CHECKS.append(check)
    return check


def number(claim: Claim) -> Printed:
    """The claim's printed number; raises AuditInputError where it is none."""
    printed = Printed.parse(claim.printed)
    if printed is None:
        raise AuditInputError(
            "is not a number", path="claims.csv", key=claim.id, value=claim.printed
        )
    return printed


def judge(claim: Claim, found: Recomputed) -> dict[str, object]:
    """One row of the audit."""
    text = claim.printed if found.printed is None else found.printed
    value = found.value.item() if isinstance(found.value, np.generic) else found.value
    printed = Printed.parse(text)
    tolerance = None
    if found.value is None:
        verdict, consequence = NOT_COMPUTABLE, found.unknown
    else:
        holds = found.holds
        if holds is None and printed is not None and not isinstance(found.value, str):
            holds, tolerance = _compare(printed, found)
        elif holds is None:
            holds = text.strip() == str(found.value).strip()
        verdict, consequence = (AGREES, found.agrees) if holds else (DISAGREES, found.disagrees)
    row = {
        "id": claim.id,
        "where": claim.where,
        "claim": claim.claim,
        "printed": text,
        "recomputed": value,
    }
    return row | {  # type: ignore[return-value]
        "unit": claim.unit,
        "tolerance": tolerance,
        "verdict": verdict,
        "consequence": consequence,
    }


def _compare(printed: Printed, found: Recomputed) -> tuple[bool, float | None]:
    """Whether a number agrees with the printed one, and the tolerance used."""
    value = float(found.value)  # type: ignore[arg-type]
    if printed.relation:
        return (value < printed.value if printed.relation == "<" else value > printed.value), None
    exact = found.exact or isinstance(found.value, int)
    tolerance = 0.0 if exact else printed.half_unit + found.half_width
    # A decimal half unit is not exact in binary: allow it its last bits.
    return abs(value - printed.value) <= tolerance + 1e-9 * max(
        abs(printed.value), tolerance
    ), tolerance
