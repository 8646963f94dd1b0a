from calibration.batches import run_batch
from calibration.jobs import logged

with logged(snakemake.log[0]):
    run_batch(
        snakemake.input.plan,
        int(snakemake.wildcards.batch),
        snakemake.params.batches,
        snakemake.output.done,
        snakemake.params.failures,
    )
