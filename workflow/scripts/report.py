from pathlib import Path

from calibration.jobs import logged, settings_of
from calibration.report import build

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    out = Path(snakemake.output[0])
    build(out.parent, out, config.target.metric)
