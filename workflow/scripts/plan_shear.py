from pathlib import Path

from calibration.bench_tests.shear import plan_shear
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    plan_shear(settings_of(snakemake.config), Path(snakemake.output.plan).parent)
