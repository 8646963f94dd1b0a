from calibration import stages
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    stages.analyse_posterior(
        config, snakemake.input.designs, snakemake.input.optimum, snakemake.output
    )
