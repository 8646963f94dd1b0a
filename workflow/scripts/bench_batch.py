from calibration import stages
from calibration.batches import run_batch

with stages.logged(snakemake.log[0]):
    run_batch(
        snakemake.input.plan,
        int(snakemake.wildcards.batch),
        snakemake.params.batches,
        snakemake.output.done,
    )
