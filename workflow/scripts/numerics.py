from calibration import stages
from calibration.numerics import analyse_numerics

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    analyse_numerics(config, snakemake.input.design, snakemake.output.table)
