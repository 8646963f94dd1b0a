from calibration import stages

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    stages.optimise(config, snakemake.input.runs, snakemake.input.region, snakemake.output)
