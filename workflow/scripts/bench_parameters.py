from calibration.bench_tests.sweep import calibrated
from calibration.jobs import logged
from dem.io.files import write_json

with logged(snakemake.log[0]):
    write_json(snakemake.output[0], {"fixed": calibrated(*snakemake.input)})
