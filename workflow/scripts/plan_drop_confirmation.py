from pathlib import Path

from calibration.bench_tests.sweep import plan_confirmation
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    plan_confirmation(config, "drop", snakemake.input.design, Path(snakemake.output.plan).parent)
