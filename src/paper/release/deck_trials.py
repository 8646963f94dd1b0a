"""Decks with the numbers as they are, beside this engine: the tables of
`docs/verification-engines.md`, from the kept heaps (`calibration.telling.export.trials`);
`deck_trials.md.j2` has the words."""

from typing import Any

from calibration.statistics.numbers import fixed
from calibration.telling.export.decks import NAMES
from calibration.telling.export.heap_profile import READERS
from calibration.telling.export.trials import OWN, trial, trials

MARGIN = 2.0
"""Of an angle [deg], where the heaps scatter less."""
LAWS = {
    "elastic_plastic": "type C, which all three codes have",
    "constant_torque": "type A on the own spin, which neither other code has: their decks have "
    "type C with the same number",
}
"""{rolling law of the study: what the decks make of it}."""


def values() -> dict[str, Any]:
    """{name: value} of `deck_trials.md.j2`."""
    kept = trials()
    return {"by": kept["poured_by"], "laws": [_law(law, kept["heaps"][law]) for law in LAWS]}


def _law(law, heaps):
    codes = [code for code in NAMES if code in heaps]
    rows = {code: trial(code, law, MARGIN) for code in codes}
    return {
        "law": law,
        "about": LAWS[law],
        "names": [NAMES[code] for code in codes],
        "heaps": {NAMES.get(code, "this engine"): len(heaps[code]) for code in (OWN, *codes)},
        "rows": [_row(index, [rows[code] for code in codes]) for index in range(len(READERS))],
        "verdicts": [f"{NAMES[code]} {_counted(rows[code])}" for code in codes],
    }


def _row(index, by_code):
    here = by_code[0][index]
    unit = f" [{'°' if here.unit == 'deg' else here.unit}]" if here.unit else ""
    return {
        "name": f"{READERS[here.quantity]}{unit}",
        "here": f"{here.here:.1f} (sd {here.here_sd:.1f})",
        "cells": [
            f"{fixed(r.difference, 1, '+')} ({fixed(r.low, 1, '+')} to {fixed(r.high, 1, '+')})"
            for r in (rows[index] for rows in by_code)
        ],
        "margin": f"{here.margin:.1f}",
    }  # fmt: skip


def _counted(rows):
    """'holds in 6 quantities, misses in none and leaves 1 open'."""
    count = {word: sum(row.verdict == word for row in rows) for word in ("holds", "misses", "open")}
    said = {word: str(n) if n else "none" for word, n in count.items()}
    return (
        f"holds in {said['holds']} of {len(rows)} quantities, misses in {said['misses']} and "
        f"leaves {said['open']} open"
    )
