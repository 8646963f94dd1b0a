from pathlib import Path

from calibration import stages
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config, snakemake.input.get("fixed"))
    stages.plan_ascent(config, snakemake.input.screening, Path(snakemake.output.plan).parent)
