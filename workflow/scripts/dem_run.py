from pathlib import Path

from calibration.runs.runner import run_each
from dem.kernel.threads import use_threads

use_threads(snakemake.threads)
run_each({Path(snakemake.output.result).parent.name: snakemake.params.spec}, snakemake.config)
