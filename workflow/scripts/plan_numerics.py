from pathlib import Path

from calibration.jobs import logged, settings_of
from calibration.numerics import plan_numerics

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config, snakemake.input.get("fixed"))
    plan_numerics(config, snakemake.input.study, Path(snakemake.output.plan).parent)
