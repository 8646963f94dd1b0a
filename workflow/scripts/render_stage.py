from pathlib import Path

import pandas as pd

from calibration.jobs import logged
from dem.render import draw_run, read_run, save_image

with logged(snakemake.log[0]):
    names = pd.read_csv(snakemake.input.design)["run_id"]
    for name in names.unique():
        image = draw_run(read_run(Path("results/runs") / name), width=480)
        save_image(image, Path(snakemake.output[0]) / f"{name}.webp")
