from pathlib import Path

from calibration.bench_tests.sweep import plan_sweep
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    plan_sweep(config, snakemake.params.test, Path(snakemake.output.plan).parent)
