from calibration import stages
from calibration.export.stage import convert

with stages.logged(snakemake.log[0]):
    i = snakemake.input
    config = stages.settings_of(snakemake.params.settings, i.get("fixed"))
    convert(config, i.optimum, i.scan, i.confirmation, i.validation, snakemake.output[0])
