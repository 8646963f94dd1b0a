from calibration.jobs import logged
from diagnosis.benchmark.study import merge

with logged(snakemake.log[0]):
    merge(snakemake.input, snakemake.output)
