from calibration.export.stage import convert
from calibration.jobs import logged, settings_of

with logged(snakemake.log[0]):
    i = snakemake.input
    config = settings_of(snakemake.config, i.get("fixed"))
    convert(config, i.optimum, i.scan, i.confirmation, i.validation, snakemake.output[0])
