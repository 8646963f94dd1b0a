"""A run's last state as files that ParaView opens."""

from pathlib import Path

from dem.io.vtk import grain_points


def export_vtk(run, path=None):
    """Write the last state of a `FinishedRun` as points with radius, velocity, speed and id (glyph them by `radius`).

    The file is `path`, or final.vtp in the run's folder. Returns its path.
    """
    path = Path(path) if path else run.folder / "final.vtp"
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial.{path.name}")
    grain_points(run.position, run.radius, run.velocity, run.tag).save(partial)
    partial.replace(path)
    return path
