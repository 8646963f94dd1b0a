"""A run's last state as files that ParaView opens."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dem.experiments import experiment_of
from dem.experiments.setup import FAR
from dem.io.vtk import write_grains, write_surfaces, write_walls

if TYPE_CHECKING:
    from dem.render.files import FinishedRun


def export_vtk(run: FinishedRun, path: str | Path | None = None) -> list[Path]:
    """Write the last state of a `FinishedRun` as points with radius, velocity, speed and id (glyph
    them by `radius`).

    The file is `path`, or final.vtp in the run's folder; the rig's walls, where there are some to
    draw, are written beside it as they stood at the end, to <name>_walls.vtp. Returns the paths.
    """
    path = Path(path) if path else run.folder / "final.vtp"
    write_grains(path, run.position, run.radius, run.velocity, run.tag)
    walls = path.with_name(f"{path.stem}_walls.vtp")
    return [path, walls] if _write_walls(walls, run) else [path]


def _write_walls(path, run):
    """Write the run's walls, but for gates that were taken away; False where there are none. For a
    run of another engine, which keeps none, those with which the experiment starts."""
    if run.walls:
        return write_surfaces(path, [w for w in run.walls if w[2][2] > FAR], run.position)
    rig = experiment_of(run.spec).walls
    return rig is not None and write_walls(path, rig(run.spec), run.position)
