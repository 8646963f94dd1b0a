from pathlib import Path

from calibration import stages
from calibration.export.stage import export
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    i = snakemake.input
    config = settings_of(snakemake.config, i.get("fixed"))
    region = stages.read_region(i.optimum)
    runs = stages.augmented_runs(config, i.runs, region, i.candidate)
    out = Path(snakemake.output.parameters).parent
    export(config, dict(i.items()), runs, region, out)
