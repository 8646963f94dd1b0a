from calibration import stages
from calibration.reproduction import reproduce, write_reproduction

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    table = reproduce(snakemake.params.studies, config)
    write_reproduction(table, snakemake.output.table, snakemake.output.summary)
