from calibration import stages
from calibration.discrepancy.settings import read_settings
from calibration.discrepancy.stages import emulate

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    settings = read_settings(snakemake.input.settings, config.diagnosis)
    emulate(config, settings, snakemake.input, snakemake.output)
