from calibration.bench_tests.sweep import analyse_sweep
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    analyse_sweep(
        config, "tilt", snakemake.input.sweep, snakemake.input.confirmation, snakemake.output
    )
