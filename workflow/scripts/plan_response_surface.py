from pathlib import Path

from calibration import stages
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config, snakemake.input.get("fixed"))
    stages.plan_response_surface(config, snakemake.input.ascent, Path(snakemake.output.plan).parent)
