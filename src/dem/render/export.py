"""A run's last state as files that ParaView opens."""

from pathlib import Path

from dem.experiments import experiment_of
from dem.io.vtk import write_grains, write_walls


def export_vtk(run, path=None):
    """Write the last state of a `FinishedRun` as points with radius, velocity, speed and id (glyph
    them by `radius`).

    The file is `path`, or final.vtp in the run's folder; the rig's walls, where the experiment has
    some to draw, are written beside it, to <name>_walls.vtp. Returns the paths.
    """
    path = Path(path) if path else run.folder / "final.vtp"
    write_grains(path, run.position, run.radius, run.velocity, run.tag)
    rig = experiment_of(run.spec).walls
    if rig is None:
        return [path]
    walls = path.with_name(f"{path.stem}_walls.vtp")
    write_walls(walls, rig(run.spec))
    return [path, walls]
