from calibration.jobs import logged, settings_of
from paper.reproduction import reproduce, write_reproduction

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
    table = reproduce(snakemake.params.studies, config)
    write_reproduction(table, snakemake.output.table, snakemake.output.summary)
