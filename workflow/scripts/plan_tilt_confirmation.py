from pathlib import Path

from calibration import stages
from calibration.bench_tests import plan_confirmation

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    plan_confirmation(config, "tilt", snakemake.input.design, Path(snakemake.output.plan).parent)
