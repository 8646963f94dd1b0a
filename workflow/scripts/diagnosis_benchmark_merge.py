from calibration import stages
from calibration.discrepancy.benchmark import merge

with stages.logged(snakemake.log[0]):
    merge(snakemake.input, snakemake.output)
