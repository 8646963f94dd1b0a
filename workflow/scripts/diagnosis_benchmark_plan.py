from calibration import stages
from calibration.discrepancy.benchmark import plan_runs
from calibration.discrepancy.settings import read_settings

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    settings = read_settings(snakemake.input.settings)
    plan_runs(config, settings, snakemake.output)
