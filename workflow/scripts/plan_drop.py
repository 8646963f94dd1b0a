from pathlib import Path

from calibration.bench_tests.sweep import plan_sweep
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    plan_sweep(settings_of(snakemake.config), "drop", Path(snakemake.output.plan).parent)
