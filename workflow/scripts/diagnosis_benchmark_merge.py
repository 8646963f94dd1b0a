from calibration.discrepancy.benchmark import merge
from calibration.jobs import logged

with logged(snakemake.log[0]):
    merge(snakemake.input, snakemake.output)
