from pathlib import Path

from calibration.jobs import logged, settings_of
from calibration.scaling.plan import plan_scaling

with logged(snakemake.log[0]):
    plan_scaling(settings_of(snakemake.config), Path(snakemake.output.plan).parent)
