from pathlib import Path

from calibration.bench_tests.sweep import plan_confirmation
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    folder = Path(snakemake.output.plan).parent
    plan_confirmation(config, snakemake.params.test, snakemake.input.design, folder)
