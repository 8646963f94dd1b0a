from pathlib import Path

from calibration.export.stage import plan_export_confirmation
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config, snakemake.input.get("fixed"))
    plan_export_confirmation(
        config,
        snakemake.input.optimum,
        snakemake.input.design,
        Path(snakemake.output.plan).parent,
    )
