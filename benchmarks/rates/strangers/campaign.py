"""The trials of strangers' tables: all of them, and 24 of which the engine is asked as well."""

import traceback
from collections.abc import Iterator
from typing import Any

import pandas as pd

from benchmarks.rates.kept_rates import KEPT, Trial, f1_score, kept
from benchmarks.rates.strangers import ask, cases, score

MOST_GAINS = 24
"""Cases of which the engine is asked as well: the first of the campaign at ten standard errors
whose law the catalogue has."""


def diagnosed(case: cases.Case, engine: bool = False) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the row of a case, and what was said; engine: with its runs."""
    drawn = case.draw()
    try:
        said = (ask.ask_engine if engine else ask.ask)(drawn.table)
    except Exception as error:
        traceback.print_exc(limit=-3)
        said = {"verdict": "failed", "reason": f"{type(error).__name__}: {error}"}
    row = {"case": case.name, "kind": case.kind, "group": case.group, "strength": case.strength,
           "seed": case.seed, **score.marks(case, drawn, said),
           "reason": str(said.get("reason", "")).replace("\n", " ")[:200]}  # fmt: skip
    return row, said


def of_gains() -> list[cases.Case]:
    """Return the cases of GAINS, fixed beforehand."""
    own = [
        c
        for c in cases.campaign()
        if c.group in ("law", "two laws")
        and c.strength == 10.0
        and all(law.names for law in c.draw().laws)
    ]
    return own[:MOST_GAINS]


def with_gains(case: cases.Case) -> dict[str, Any]:
    """Return the row of a case of which the engine was asked."""
    row, said = diagnosed(case, engine=True)
    laws = said.get("laws", [])
    ends = [(law["gain"] or {}).get("held_out_rmse_difference_interval") for law in laws]
    row["gains"] = "; ".join(f"{a:.2f} to {b:.2f}" for a, b in filter(None, ends))
    row["withdrawn"] = "; ".join(n for law in laws for n in law.get("withdrawn", []))
    return row


def told(rows: pd.DataFrame, gains: pd.DataFrame | None = None) -> Iterator[str]:
    """Yield lines of Markdown: the rates, of a name that loses those of `gains`, of which the
    engine was asked; the kept ones unless given."""
    gains = kept(GAINS.kept) if gains is None else gains
    yield from ("| | share (95 % interval) | asked |", "|---|---|---|")
    rates = score.rates(rows).set_index("figure", drop=False)
    if len(gains):
        rates.loc[score.LOSES] = score.rates(gains).set_index("figure", drop=False).loc[score.LOSES]
    for r in rates.itertuples():
        asked = "" if pd.isna(r.asked) else f"{'at most ' * r.most}{r.asked:.0%}"
        share = f"{r.hits} of {r.of} ({r.low:.0%} to {r.high:.0%})" if r.of else "not drawn"
        yield f"| {r.figure} | {share} | {asked} |"
    f1 = f1_score(*(int(rows[column].sum()) for column in ("hits", "true", "placed")))
    yield f"| F1 of the places | {f1:.2f} | |"


def _named(case):
    return {"case": case.name}


TRIAL = Trial(
    "strangers", KEPT / "strangers.csv", "contacts", cases.campaign, _named,
    lambda case: diagnosed(case)[0], told,
)  # fmt: skip
GAINS = Trial(
    "strangers gains", KEPT / "strangers_gains.csv", "contacts", of_gains, _named, with_gains, told
)
