from pathlib import Path

from calibration import stages
from calibration.export.stage import plan_export_scan

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings, snakemake.input.get("fixed"))
    plan_export_scan(config, snakemake.input.optimum, Path(snakemake.output.plan).parent)
