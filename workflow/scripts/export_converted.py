from pathlib import Path

from calibration.export.stage import export_converted
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    i = snakemake.input
    config = settings_of(snakemake.config, i.get("fixed"))
    export_converted(config, dict(i.items()), Path(snakemake.output[0]).parent)
