from calibration import stages

config = stages.settings_of(snakemake.params.settings)
stages.optimise(config, snakemake.input.runs, snakemake.input.region, snakemake.output)
