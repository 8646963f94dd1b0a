from calibration.audit import run_audit, write_audit
from calibration.jobs import logged

with logged(snakemake.log[0]):
    write_audit(run_audit("data/paper"), snakemake.output.table, snakemake.output.page)
