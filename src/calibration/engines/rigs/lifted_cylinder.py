"""The lifted cylinder in other codes. What differs from ours: the cylinder stops when it is clear
of the grains, where ours rises on above them."""

from pathlib import Path
from typing import Any

import numpy as np

from calibration.engines import bed
from calibration.engines.family import Code
from calibration.engines.program import read_dump, state_of, time_of
from calibration.engines.templates import words
from dem.experiments import lifted_cylinder as own
from dem.experiments.phases import RESTS
from dem.experiments.phases import look as pause_of
from dem.experiments.setup import time_step_of
from dem.measure.heap import coverage, measure_heap
from dem.spec import RunSpec

CLEAR = 1.2
"""Depths of the grains by which the cylinder rises."""


def deck(spec: RunSpec, code: Code, folder: Path) -> str:
    """Text of the deck of a `RunSpec`; its grains and walls are written into `folder`."""
    rig = own.Rig(spec)
    grains, top = bed.filled(spec, rig.radius, 0.0)
    pause = 2.0 * pause_of(spec)
    speed, look = 1e-3 * spec.geometry.lift_speed_mm_s, bed.steps(spec, pause)
    side, height = 1.5 * rig.plate, (1.0 + CLEAR) * top + speed * pause + bed.ROOM
    low, high = (-side, -side, -own.LOST_BELOW * rig.plate), (side, side, height)
    text = bed.start(spec, grains, code, folder, low, high)
    text += code.walls(rig.walls(top), folder, moves="cylinder")
    text += bed.settle(spec, grains)
    text += words("family").lift(
        CLEAR / speed / (look * time_step_of(spec)), look,
        code.words.lift("cylinder", speed), code.words.hold("cylinder"),
    )  # fmt: skip
    looks = max(round(spec.numerics.max_time_s / pause), 1)
    text += words("family").until("rest", look, looks, RESTS * grains.lift_energy, 0)
    return text + words("family").dump("end")


def read(spec: RunSpec, folder: Path, output: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Metrics and last state of a run in `folder`. Raises EngineError, MeasureError. The state is
    as `program.state_of` gives it."""
    plate = own.Rig(spec).plate
    depth = float(read_dump(folder / "settled.dump")["z"].max())
    state = state_of(read_dump(folder / "end.dump"))
    position, radius = state["position"], state["radius"]
    found = measure_heap(position, radius, state["velocity"], plate)
    names = [m.name for m in own.EXPERIMENT.metrics]
    metrics = {k: v for k, v in found.items() if k in names} | {
        "spilled": spec.particles.count - len(np.unique(state["tag"])),
        "plate_coverage": coverage(position, radius, plate),
        "base_radius_mm": 1e3 * own.base_radius(position, plate),
        "column_depth_mm": 1e3 * depth,
        "rest_time_s": time_of(folder / "end.dump", time_step_of(spec)),
    }
    return metrics, state
