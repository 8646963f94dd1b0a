from calibration.jobs import logged, work_for
from calibration.report import build
from calibration.stages import load_stages

with logged(snakemake.log[0]):
    stages = load_stages(*snakemake.params.declared)
    study = work_for(snakemake.config)
    build(study.folder, snakemake.output[0], stages, study.config.target.metric)
