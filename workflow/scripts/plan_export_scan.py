from pathlib import Path

from calibration.export.stage import plan_export_scan
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config, snakemake.input.get("fixed"))
    plan_export_scan(config, snakemake.input.optimum, Path(snakemake.output.plan).parent)
