from pathlib import Path

from calibration import stages

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings, snakemake.input.get("fixed"))
    stages.plan_response_surface(config, snakemake.input.ascent, Path(snakemake.output.plan).parent)
