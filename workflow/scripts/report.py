from pathlib import Path

from calibration import stages
from calibration.report import build

with stages.logged(snakemake.log[0]):
    build(Path(snakemake.output[0]).parent, snakemake.output[0])
