from pathlib import Path

from calibration import stages
from calibration.report import build

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    out = Path(snakemake.output[0])
    build(out.parent, out, config.target.metric)
