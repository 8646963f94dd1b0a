from calibration.jobs import logged, settings_of
from calibration.numerics import analyse_numerics

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    analyse_numerics(config, snakemake.input.design, snakemake.output.table)
