from calibration import stages
from calibration.bench_tests import calibrated
from dem.io.files import write_json

with stages.logged(snakemake.log[0]):
    write_json(snakemake.output[0], {"fixed": calibrated(*snakemake.input)})
