"""A run's last state as files that ParaView opens."""

from pathlib import Path

from dem.experiments import experiment_of
from dem.io.vtk import grain_points, write_walls


def export_vtk(run, path=None):
    """Write the last state of a `FinishedRun` as points with radius, velocity, speed and id (glyph
    them by `radius`).

    The file is `path`, or final.vtp in the run's folder; the rig's walls, where the experiment has
    some to draw, are written beside it, to <name>_walls.vtp. Returns the paths.
    """
    path = Path(path) if path else run.folder / "final.vtp"
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial.{path.name}")
    grain_points(run.position, run.radius, run.velocity, run.tag).save(partial)
    partial.replace(path)
    rig = experiment_of(run.spec).walls
    if rig is None:
        return [path]
    walls = path.with_name(f"{path.stem}_walls.vtp")
    write_walls(walls, rig(run.spec))
    return [path, walls]
