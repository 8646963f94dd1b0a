from pathlib import Path

from calibration.runs.runner import run_logged
from dem.kernel.threads import use_threads

use_threads(snakemake.threads)
run_logged(
    snakemake.params.spec, Path(snakemake.output.result).parent, snakemake.log[0], snakemake.config
)
