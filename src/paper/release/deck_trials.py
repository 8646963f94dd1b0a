"""Decks with the numbers as they are, beside this engine: the tables of
`docs/verification-engines.md`, from the kept heaps (`calibration.telling.export.trials`);
`deck_trials.md.j2` has the words."""

from typing import Any

from calibration.engines.blocks.rolling import ELASTIC_PLASTIC
from calibration.statistics.numbers import fixed
from calibration.telling.export.decks import NAMES
from calibration.telling.export.heap_profile import READERS
from calibration.telling.export.trial_heaps import KINDS
from calibration.telling.export.trials import OWN, rows_in, trials

MARGIN = 2.0
"""Of an angle [deg], where the heaps scatter less."""


def values() -> dict[str, Any]:
    """{name: value} of `deck_trials.md.j2`."""
    kept = trials()
    names = {"dem": "this engine", **NAMES}
    poured = [f"{names[code]} `{version}`" for code, version in kept["poured_by"].items()]
    return {"poured": poured, "trials": [_trial(n, t) for n, t in kept["trials"].items()]}


def _trial(name, kept):
    heaps = kept["heaps"]
    codes = [code for code in NAMES if code in heaps]
    rows = {code: rows_in(code, name, MARGIN) for code in codes}
    return {
        "name": name,
        "about": KINDS[name].about + _found(kept["rolling"]),
        "codes": [NAMES[code] for code in codes],
        "heaps": {NAMES.get(code, "this engine"): len(heaps[code]) for code in (OWN, *codes)},
        "rows": [_row(index, [rows[code] for code in codes]) for index in range(len(READERS))],
        "verdicts": [f"{NAMES[code]} {_counted(rows[code])}" for code in codes],
    }


def _found(rolling):
    """What the search for other codes' numbers came to, of one that was made."""
    if not rolling:
        return ""
    turn = "" if rolling["path"] == ELASTIC_PLASTIC else " of grains that do not turn"
    static, mu_r = rolling["static_friction"], rolling["rolling_friction"]
    number = f"static friction {static:.3g}" if turn else f"rolling friction {mu_r:.3g}"
    return f": {number}{turn}"


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
