"""Pictures of a stage's heaps."""

from pathlib import Path

from calibration.intake.tables import read_written
from calibration.runs.store import RunStore
from dem.render import draw_run, read_run, save_image

WIDTH = 480
FROM_ABOVE = 25.0  # deg, the view of grains that form no heap: they have no flanks to draw


def heaps(study, source, output):
    """Draw each run of a design into the folder that is the only output."""
    store = RunStore()
    for name in read_written(source.design)["run_id"].unique():
        run = read_run(store.folder(name))
        stands = "angle_of_repose_deg" in run.metrics
        view = {} if stands else {"azimuth": 0.0, "elevation": FROM_ABOVE}
        image = draw_run(run, width=WIDTH, **view)
        save_image(image, Path(output[0]) / f"{name}.webp")
