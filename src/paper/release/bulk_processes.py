"""What `docs/evidence.md` says of the benchmark that others chose, from its kept runs and
speeds; `bulk_processes.md.j2` has the words."""

from __future__ import annotations

import math
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed

FOLDER = "bulk-processes"
NAMES = {"dem": "this engine", "liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
RUNS, SPEEDS = "runs.csv", "speeds.csv"
UNITS = {"nanometres": "nm", "micrometres": "um", "tenths of a mm": "0.1mm"}
STARTS = {
    unit: ("dem", *(f"dem-moved-{k}-{short}" for k in (1, 2, 3, 4)))
    for unit, short in UNITS.items()
}
"""Runs of this engine whose starts differ by one to four of a unit: what chance makes of a fall."""
ODD = 0.05
"""Of a fall of another code among those of the starts: what is less likely is not chance."""
FALL = "penetration-25K"
GRAIN = 1e-3
"""Radius of the bed's grains [m]."""
HEIGHTS = (0.02, 0.024, 0.028, 0.032, 0.036, 0.04)
"""Times at which the table has the height of the sphere [s]."""


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} of `bulk_processes.md.j2`, from the folder of kept results."""
    folder = Path(kept) / FOLDER
    speeds, runs = read_written(folder / SPEEDS), read_written(folder / RUNS)
    falls = {
        code: read_written(folder / f"{FALL}.{code}.csv").set_index("time_s")["height_m"]
        for code in dict.fromkeys(chain(NAMES, *STARTS.values()))
        if ((runs["case"] == FALL) & (runs["code"] == code)).any()
    }
    present = {unit: [falls[c] for c in own if c in falls] for unit, own in STARTS.items()}
    starts = {unit: own for unit, own in present.items() if len(own) > 2}
    codes = {NAMES[code]: fall for code, fall in falls.items() if code in NAMES}
    others = {name: fall for name, fall in codes.items() if name != NAMES["dem"]}
    return {
        "speeds": [_speed(speeds[speeds["case"] == case]) for case in speeds["case"].unique()],
        "codes": list(NAMES.values()),
        "machine": " and ".join(sorted(speeds["machine"].unique())),
        "date": speeds["date"].max(),
        "engine": runs.loc[runs["code"] == "dem", "engine"].iloc[-1],
        "fallen": list(codes),
        "starts": {unit: len(own) for unit, own in starts.items()},
        "heights": [
            [f"{1000 * time:g}", *(_millimetres(_at(fall, time)) for fall in codes.values()),
             *(_span(own, time) for own in starts.values())]
            for time in HEIGHTS
        ],
        "apart": {name: _apart(falls["dem"], fall) for name, fall in others.items()},
        "lowest_ms": f"{1000 * falls['dem'].idxmin():g}",
        "end_ms": f"{1000 * HEIGHTS[-1]:g}",
        "chance": {
            name: {unit: _chance(own, fall) for unit, own in starts.items()}
            for name, fall in others.items()
        },
        "odd": ODD,
        "spent": {name: f"{_whole(runs, code):,.0f} s" for code, name in NAMES.items()
                  if name in codes},
    }  # fmt: skip


def _speed(rows):
    """A case's speeds as a row of the table: million particle-steps a second of each code, with the
    part of this engine's that it is."""
    rates = rows.set_index("code")["particle_steps_per_s"] / 1e6
    return {
        "case": rows["case"].iloc[0],
        "grains": f"{int(rows['grains'].iloc[0]):,}",
        "cells": [_cell(rates, code) for code in NAMES],
    }


def _cell(rates, code):
    if code not in rates:
        return "not run"
    part = "" if code == "dem" else f" (1/{rates['dem'] / rates[code]:.3g})"
    return f"{rates[code]:.3g}{part}"


def _whole(runs, code):
    """Processor time [s] of the whole fall."""
    return runs.loc[(runs["case"] == FALL) & (runs["code"] == code), "processor_s"].iloc[-1]


def _at(fall, time):
    """Height at the look nearest to a time."""
    return fall.iloc[abs(fall.index - time).argmin()]


def _millimetres(height):
    return f"{1000 * height:.2f}"


def _span(falls, time):
    """Lowest and highest of some falls at a time [mm], in words."""
    heights = [_at(fall, time) for fall in falls]
    return f"{_millimetres(min(heights))} to {_millimetres(max(heights))}"


def _apart(ours, fall):
    """Largest distance of a code's sphere from ours at a common look, on the way down and at any,
    in radii of a grain."""
    looks = fall.index[fall.index <= ours.index.max() + 1e-9]
    off = [abs(_at(ours, look) - fall[look]) / GRAIN for look in looks]
    down = [d for d, look in zip(off, looks, strict=True) if look < ours.idxmin()]
    return fixed(max(down), 2), fixed(max(off), 2)


def _chance(starts, fall):
    """p of another code's last height as one more of the starts' (t test of one new value)."""
    own = np.array([_at(start, HEIGHTS[-1]) for start in starts])
    error = own.std(ddof=1) * math.sqrt(1.0 + 1.0 / len(own))
    return float(2.0 * stats.t.sf(abs(_at(fall, HEIGHTS[-1]) - own.mean()) / error, len(own) - 1))
