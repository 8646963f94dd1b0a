from calibration import stages
from calibration.audit import run_audit, write_audit

with stages.logged(snakemake.log[0]):
    write_audit(run_audit("data/paper"), snakemake.output.table, snakemake.output.page)
