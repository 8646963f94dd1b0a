from calibration.discrepancy.benchmark import emulate
from calibration.discrepancy.settings import read_settings
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    settings = read_settings(snakemake.input.settings)
    emulate(config, settings, snakemake.input, snakemake.output)
