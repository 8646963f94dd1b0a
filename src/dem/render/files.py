"""What a run left in its folder, for drawing."""

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem.errors import DemError
from dem.spec import parse_spec


@dataclass(frozen=True)
class FinishedRun:
    """A finished run: its spec, its metrics and its last state; position, velocity (n, 3), radius, tag (n,), SI."""

    folder: Path
    spec: object
    metrics: dict
    position: np.ndarray
    radius: np.ndarray
    velocity: np.ndarray
    tag: np.ndarray

    @property
    def frames(self):
        """Paths of the frames that `dem run --frames` wrote, in order of time."""
        return sorted((self.folder / "frames").glob("grains_*.vtp"))


def read_run(folder):
    """`FinishedRun` of a folder that `dem run` wrote. Raises DemError when the run is not finished or not whole."""
    folder = Path(folder)
    if not (folder / "result.json").is_file():
        raise DemError(f"{folder}: no result.json; `dem run SPEC --out {folder}` makes one")
    try:
        result = json.loads((folder / "result.json").read_text())
        spec, metrics = (
            parse_spec(result["spec"], file=str(folder / "result.json")),
            result["metrics"],
        )
    except (ValueError, KeyError, TypeError) as error:
        raise DemError(f"{folder / 'result.json'}: is not a run's result ({error})") from None
    try:
        with np.load(folder / "final.npz") as state:
            arrays = {k: state[k] for k in ("position", "radius", "velocity", "tag")}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise DemError(f"{folder / 'final.npz'}: is not a run's last state ({error})") from None
    return FinishedRun(folder, spec, metrics, **arrays)
