"""The trials of strangers' tables: all of them, and 24 of which the engine is asked as well."""

import traceback
from typing import Any

import pandas as pd

from benchmarks.rates.kept_rates import WORDS, Trial, f1_score, figures, kept
from benchmarks.rates.strangers import ask, cases, score

MOST_GAINS = 24
"""Cases of which the engine is asked as well: the first of the campaign at ten standard errors
whose law the catalogue has."""


def diagnosed(case: cases.Case, engine: bool = False) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the row of a case, and what was said; engine: with its runs."""
    drawn = case.draw()
    try:
        said = ask.ask(drawn.table, engine)
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
    ends = [(law["gain"] or {}).get(score.GAIN) for law in laws]
    row["gains"] = "; ".join(f"{a:.2f} to {b:.2f}" for a, b in filter(None, ends))
    row["withdrawn"] = "; ".join(n for law in laws for n in law.get("withdrawn", []))
    return row


def told(rows: pd.DataFrame) -> str:
    """Return Markdown: the rates, of a name that loses those of the kept GAINS."""
    gains = kept(GAINS.kept, GAINS.of)
    shown = figures("strangers", rows)
    if len(gains):
        loses = "a name with a gain below zero"
        by_engine = {f["figure"]: f for f in figures("strangers", gains)}
        shown = [by_engine[loses] if f["figure"] == loses else f for f in shown]
    f1 = f1_score(*(int(rows[column].sum()) for column in ("hits", "true", "placed")))
    return WORDS.strangers(shown, f1)


TRIAL = Trial("strangers", "contacts", cases.campaign, lambda case: diagnosed(case)[0], told)
GAINS = Trial("strangers_gains", "contacts", of_gains, with_gains, told)
