from pathlib import Path

from calibration import stages
from calibration.bench_tests import plan_sweep

with stages.logged(snakemake.log[0]):
    plan_sweep(
        stages.settings_of(snakemake.params.settings), "tilt", Path(snakemake.output.plan).parent
    )
