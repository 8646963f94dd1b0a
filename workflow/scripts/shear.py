from calibration.bench_tests.shear import analyse_shear
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    analyse_shear(settings_of(snakemake.config), snakemake.input.design, snakemake.output)
