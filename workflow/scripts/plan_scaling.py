from pathlib import Path

from calibration import stages
from calibration.scaling_plan import plan_scaling

with stages.logged(snakemake.log[0]):
    plan_scaling(stages.settings_of(snakemake.params.settings), Path(snakemake.output.plan).parent)
