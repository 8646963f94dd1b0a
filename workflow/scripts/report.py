from calibration import stages
from calibration.report import build

with stages.logged(snakemake.log[0]):
    build(snakemake.params.study, snakemake.output[0])
