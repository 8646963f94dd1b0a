from calibration import stages
from calibration.scaling_study import analyse_scaling

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    analyse_scaling(config, snakemake.input.design, snakemake.output)
