"""Decks with the numbers as they are, beside this engine: the tables of
`docs/other-codes.md`, from the kept heaps (`calibration.telling.export.trials`);
`deck_trials.md.j2` has the words."""

from typing import Any

from calibration.statistics.numbers import fixed
from calibration.telling.export.decks import NAMES
from calibration.telling.export.heap_profile import READERS
from calibration.telling.export.trials import rows_in, trials

MARGIN = 2.0
"""Of an angle [deg], where the heaps scatter less."""


def values() -> dict[str, Any]:
    """{name: value} of `deck_trials.md.j2`."""
    kept = trials()
    names = {"dem": "this engine", **NAMES}
    poured = [f"{names[code]} `{version}`" for code, version in kept["poured_by"].items()]
    told = [_trial(n, t) for n, t in kept["trials"].items()]
    codes = list(dict.fromkeys(code for trial in told for code in trial["codes"]))
    return {"poured": poured, "codes": codes, "trials": told}


def _trial(name, kept):
    heaps = kept["heaps"]
    codes = [code for code in NAMES if code in heaps]
    rows = {code: rows_in(code, name, MARGIN) for code in codes}
    return {
        "name": name,
        "codes": [NAMES[code] for code in codes],
        "rows": [_row(index, [rows[code] for code in codes]) for index in range(len(READERS))],
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
