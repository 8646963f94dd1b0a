from calibration import stages
from calibration.discrepancy.settings import read_settings
from calibration.discrepancy.stages import conclude

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    settings = read_settings(snakemake.input.settings, config.diagnosis)
    conclude(config, settings, snakemake.input, snakemake.output)
