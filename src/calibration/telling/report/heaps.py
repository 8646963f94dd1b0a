"""Chosen heaps as data for the page's viewer."""

from __future__ import annotations

import base64
import json
from typing import TYPE_CHECKING

import numpy as np

from calibration.figures import label
from calibration.intake.tables import read_written
from calibration.runs.store import RunStore
from dem.errors import DemError
from dem.render import read_run
from dem.render.flanks import fitted_flanks, heap_grains
from dem.render.image import plate_of

if TYPE_CHECKING:
    from pathlib import Path

    from calibration.figures import Response


LEVELS = 65535  # of a coordinate, 16 bits


def viewer(study: Path, response: Response) -> dict[str, str] | None:
    """`scenes`, JSON for the page's viewer: the validated heap nearest to the mean, and the
    screening's extremes; `first`, the run of the first one. None where no heap's state is at
    hand."""
    found = [
        (run_id, scene)
        for run_id, text in _chosen(study, response)
        if (scene := _scene(run_id, text)) is not None
    ]
    if not found:
        return None
    return {"scenes": json.dumps([scene for _, scene in found]), "first": found[0][0]}


def _chosen(study, response):
    """(run_id, name) of the heaps to show."""
    chosen = []
    for stage, picks in (("validation", "middle"), ("screening", "extremes")):
        path = study / stage / "runs.csv"
        if not path.exists():
            continue
        runs = read_written(path)
        y = runs["response"]
        at = [(y - y.mean()).abs().idxmin()] if picks == "middle" else [y.idxmin(), y.idxmax()]
        names = ["calibrated"] if picks == "middle" else ["lowest of the screening", "highest"]
        for k, name in zip(at, names, strict=True):
            chosen.append((runs.loc[k, "run_id"], f"{name}, {response.value(y[k])}"))
    return chosen


def _scene(run_id, name):
    """One heap: grains in the order of pouring as 16-bit numbers x, y, z, radius over `scale`
    [mm]."""
    try:
        run = read_run(RunStore().folder(run_id))
    except DemError:
        return None  # the result was moved here without its state
    plate = plate_of(run.spec)
    if plate is None or not len(run.tag):  # another program may leave no grains
        return None
    order = np.argsort(run.tag)
    state = 1e3 * np.column_stack([run.position, run.radius])[order]
    scale = 1.001 * float(np.abs(state).max())
    packed = np.rint((state / scale + 1.0) * 0.5 * LEVELS).astype("<u2")
    return {
        "name": label(name),
        "plate": 1e3 * plate,
        "cone": _cone(run, plate),
        "angle": run.metrics["angle_of_repose_deg"],
        "scale": scale,
        "count": len(state),
        "grains": base64.b64encode(packed.tobytes()).decode(),
    }


def _cone(run, plate):
    """Radius [mm] at which the cone of the run's angle of repose meets the plate: mean of the
    fitted lines."""
    part = heap_grains(run.position, run.radius, run.velocity, plate)
    position, radius = run.position[part], run.radius[part]
    toes = [
        abs(flank.end[0])
        for azimuth in range(0, 180, 15)
        for flank in fitted_flanks(position, radius, plate, azimuth)
        if flank
    ]
    return 1e3 * float(np.mean(toes))
