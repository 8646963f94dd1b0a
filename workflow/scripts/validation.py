from calibration import stages
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    stages.analyse_validation(config, snakemake.input.design, snakemake.output)
