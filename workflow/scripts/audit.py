from calibration.jobs import logged
from paper.audit import run_audit, write_audit

with logged(snakemake.log[0]):
    write_audit(run_audit("data/paper"), snakemake.output.table, snakemake.output.page)
