from calibration.jobs import logged, settings_of
from diagnosis.benchmark.study import plan_runs
from diagnosis.settings import read_settings

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    settings = read_settings(snakemake.input.settings)
    plan_runs(config, settings, snakemake.output)
