from calibration import stages
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    stages.analyse_response_surface(
        config, snakemake.input.design, snakemake.input.region, snakemake.output
    )
