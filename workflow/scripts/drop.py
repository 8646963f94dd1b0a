from calibration import stages
from calibration.bench_tests import analyse_sweep

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    analyse_sweep(
        config, "drop", snakemake.input.sweep, snakemake.input.confirmation, snakemake.output
    )
