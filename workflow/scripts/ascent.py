from calibration import stages

config = stages.settings_of(snakemake.params.settings)
stages.analyse_ascent(config, snakemake.input.design, snakemake.output)
