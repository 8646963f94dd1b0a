from calibration import stages

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    stages.analyse_screening(config, snakemake.input.design, snakemake.output)
