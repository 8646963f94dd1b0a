"""What `docs/bulk-processes.md` says of the benchmark that others chose, from its kept runs and
speeds; `bulk_processes.md.j2` has the words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed
from dem.benchmark.bulk_processes.__main__ import RUNS, SPEEDS

FOLDER = "bulk-processes"
NAMES = {"dem": "this engine", "liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
ITSELF = {"dem-double": "this engine in double precision"}
"""Beside which the others' falls are seen: what rounding alone makes of a fall."""
FALLEN = NAMES | ITSELF
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
        for code in FALLEN
        if ((runs["case"] == FALL) & (runs["code"] == code)).any()
    }
    return {
        "speeds": [_speed(speeds[speeds["case"] == case]) for case in speeds["case"].unique()],
        "codes": list(NAMES.values()),
        "machine": " and ".join(sorted(speeds["machine"].unique())),
        "date": speeds["date"].max(),
        "engine": runs.loc[runs["code"] == "dem", "engine"].iloc[-1],
        "fallen": [FALLEN[code] for code in falls],
        "heights": [
            [f"{1000 * time:g}", *(f"{1000 * _at(fall, time):.2f}" for fall in falls.values())]
            for time in HEIGHTS
        ],
        "apart": _apart(falls),
        "lowest_ms": f"{1000 * falls['dem'].idxmin():g}",
        "spent": {FALLEN[code]: f"{_whole(runs, code):,.0f} s" for code in falls},
    }


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


def _apart(falls):
    """{other code: (largest distance of its sphere from ours at a common look on the way down,
    and at any), in radii of a grain}."""
    ours = falls["dem"]
    far = {}
    for code, fall in falls.items():
        if code != "dem":
            looks = fall.index[fall.index <= ours.index.max() + 1e-9]
            off = [abs(_at(ours, look) - fall[look]) / GRAIN for look in looks]
            down = [d for d, look in zip(off, looks, strict=True) if look < ours.idxmin()]
            far[FALLEN[code]] = fixed(max(down), 2), fixed(max(off), 2)
    return far
