from calibration import stages

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    stages.analyse_validation(config, snakemake.input.design, snakemake.output)
