from calibration import stages

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    stages.analyse_response_surface(
        config, snakemake.input.design, snakemake.input.region, snakemake.output
    )
