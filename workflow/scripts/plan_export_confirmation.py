from pathlib import Path

from calibration import stages
from calibration.export.stage import plan_export_confirmation

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings, snakemake.input.get("fixed"))
    plan_export_confirmation(
        config,
        snakemake.input.optimum,
        snakemake.input.design,
        Path(snakemake.output.plan).parent,
    )
