from calibration.jobs import logged, settings_of
from diagnosis.settings import read_settings
from diagnosis.stages import conclude

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    settings = read_settings(snakemake.input.settings, config.diagnosis)
    conclude(config, settings, snakemake.input, snakemake.output)
