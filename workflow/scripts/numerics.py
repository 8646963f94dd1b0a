from calibration.jobs import logged, settings_of
from calibration.numerics import analyse_numerics

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    out = snakemake.output
    analyse_numerics(config, snakemake.input.design, out.table, out.figure)
