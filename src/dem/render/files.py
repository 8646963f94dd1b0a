"""What a run left in its folder: read for drawing, and written for ParaView."""

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dem.errors import DemError, ResultError
from dem.experiments import experiment_of
from dem.experiments.setup import FAR
from dem.io.vtk import write_grains, write_surfaces, write_walls
from dem.results import RESULT, STATE, read_result
from dem.spec import parse_spec

WALLS = ("wall_kind", "wall_parameters", "wall_origin", "wall_rotation")


@dataclass(frozen=True)
class FinishedRun:
    """A finished run: its spec, its metrics and its last state; position, velocity (n, 3), radius,
    tag (n,), SI.

    walls: wall elements as they stood at the end, each (kind, parameters, origin, rotation); empty
    where the run kept none, as one of another engine does.
    """

    folder: Path
    spec: Any
    metrics: dict
    position: np.ndarray
    radius: np.ndarray
    velocity: np.ndarray
    tag: np.ndarray
    walls: tuple = ()


def read_run(folder: str | Path) -> FinishedRun:
    """`FinishedRun` of a folder that `dem run` wrote. Raises DemError when the run is not finished
    or not whole."""
    folder = Path(folder)
    try:
        result = read_result(folder)
    except ResultError as error:
        if not error.missing:
            raise
        again = f"`dem run SPEC --out {folder}` makes one"
        raise DemError(f"{folder}: no result.json; {again}") from None
    spec = parse_spec(result["spec"], file=str(folder / RESULT))
    try:
        with np.load(folder / STATE) as state:
            arrays = {k: state[k] for k in ("position", "radius", "velocity", "tag")}
            if WALLS[0] in state:
                arrays["walls"] = tuple(zip(*(state[k] for k in WALLS), strict=True))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise DemError(f"{folder / STATE}: is not a run's last state ({error})") from None
    return FinishedRun(folder, spec, result["metrics"], **arrays)


def export_vtk(run: FinishedRun, path: str | Path | None = None) -> list[Path]:
    """Write the last state of a `FinishedRun` as points with radius, velocity, speed and id (glyph
    them by `radius`).

    The file is `path`, or final.vtp in the run's folder; the rig's walls, where there are some to
    draw, are written beside it as they stood at the end, to <name>_walls.vtp. Returns the paths.
    """
    path = Path(path) if path else run.folder / "final.vtp"
    write_grains(path, run.position, run.radius, run.velocity, run.tag)
    walls = path.with_name(f"{path.stem}_walls.vtp")
    rig = experiment_of(run.spec).walls
    if run.walls:  # but for gates that were taken away
        drawn = write_surfaces(walls, [w for w in run.walls if w[2][2] > FAR], run.position)
    else:  # of another engine, which keeps none: those with which the experiment starts
        drawn = rig is not None and write_walls(walls, rig(run.spec), run.position)
    return [path, walls] if drawn else [path]
