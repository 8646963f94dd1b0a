"""Pictures of a stage's heaps."""

from pathlib import Path

from calibration.store import RunStore
from calibration.tables import read_written
from dem.render import draw_run, read_run, save_image

WIDTH = 480


def heaps(study, source, output):
    """Draw each run of a design into the folder that is the only output."""
    store = RunStore()
    for name in read_written(source.design)["run_id"].unique():
        image = draw_run(read_run(store.folder(name)), width=WIDTH)
        save_image(image, Path(output[0]) / f"{name}.webp")
