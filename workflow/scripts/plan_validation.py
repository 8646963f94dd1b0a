from pathlib import Path

from calibration import stages

config = stages.settings_of(snakemake.params.settings)
stages.plan_validation(config, snakemake.input.optimum, Path(snakemake.output.plan).parent)
