from calibration import stages
from calibration.bench_tests import analyse_shear

with stages.logged(snakemake.log[0]):
    analyse_shear(
        stages.settings_of(snakemake.params.settings), snakemake.input.design, snakemake.output
    )
