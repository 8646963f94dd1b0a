from pathlib import Path

from calibration import stages
from calibration.shear import plan_shear

with stages.logged(snakemake.log[0]):
    plan_shear(stages.settings_of(snakemake.params.settings), Path(snakemake.output.plan).parent)
