from calibration.batches import run_batch, run_told_batch
from calibration.jobs import logged, work_for

work_for(snakemake.config)
share = (
    snakemake.input.plan,
    int(snakemake.wildcards.batch),
    snakemake.params.batches,
    snakemake.output.done,
)
if snakemake.params.failures == "told":
    run_told_batch(*share, snakemake.log[0], snakemake.config)
else:
    with logged(snakemake.log[0]):
        run_batch(*share, snakemake.params.failures)
