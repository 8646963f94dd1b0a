from calibration.jobs import logged, settings_of
from calibration.scaling.study import analyse_scaling

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    analyse_scaling(config, snakemake.input.design, snakemake.output)
