import sys

from calibration.chain.jobs import leave_record, logged, work_for
from calibration.study.stage import load_stages
from calibration.telling.report.build import build

with logged(snakemake.log[0]):
    stages = load_stages(*snakemake.params.declared)
    study = work_for(snakemake.config)
    for missing in build(study.folder, snakemake.output[0], stages, study.config.target):
        print(missing, file=sys.__stderr__)
    leave_record(snakemake, study)
