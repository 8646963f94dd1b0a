from calibration import stages
from calibration.shear import analyse_shear

with stages.logged(snakemake.log[0]):
    analyse_shear(
        stages.settings_of(snakemake.params.settings), snakemake.input.design, snakemake.output
    )
