"""What a run left in its folder, for drawing."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem.errors import DemError, ResultError
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
    spec: object
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
        if error.missing:
            again = f"`dem run SPEC --out {folder}` makes one"
            raise DemError(f"{folder}: no result.json; {again}") from None
        raise
    spec = parse_spec(result["spec"], file=str(folder / RESULT))
    try:
        with np.load(folder / STATE) as state:
            arrays = {k: state[k] for k in ("position", "radius", "velocity", "tag")}
            if WALLS[0] in state:
                arrays["walls"] = tuple(zip(*(state[k] for k in WALLS), strict=True))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise DemError(f"{folder / STATE}: is not a run's last state ({error})") from None
    return FinishedRun(folder, spec, result["metrics"], **arrays)
