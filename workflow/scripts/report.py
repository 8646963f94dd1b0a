from calibration.jobs import logged
from calibration.report import build
from calibration.stages import load_stages
from calibration.study import Study

with logged(snakemake.log[0]):
    stages = load_stages(*snakemake.params.declared)
    study = Study.of(snakemake.config)
    build(study.folder, snakemake.output[0], stages, study.config.target.metric)
