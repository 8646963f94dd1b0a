from pathlib import Path

from calibration import stages

config = stages.settings_of(snakemake.params.settings)
stages.plan_ascent(config, snakemake.input.screening, Path(snakemake.output.plan).parent)
