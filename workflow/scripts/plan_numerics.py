from pathlib import Path

from calibration import stages
from calibration.numerics import plan_numerics

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings, snakemake.input.get("fixed"))
    plan_numerics(config, snakemake.input.study, Path(snakemake.output.plan).parent)
