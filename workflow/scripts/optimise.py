from calibration import stages
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    stages.optimise(
        config,
        snakemake.input.runs,
        snakemake.input.region,
        snakemake.output,
        snakemake.input.candidate,
    )
