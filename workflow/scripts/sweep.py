from calibration.bench_tests.sweep import analyse_sweep
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    i = snakemake.input
    analyse_sweep(config, snakemake.params.test, i.sweep, i.confirmation, snakemake.output)
