from pathlib import Path

from calibration.runner import run_logged

run_logged(
    snakemake.params.spec, Path(snakemake.output.result).parent, snakemake.log[0], snakemake.config
)
