from calibration.runs.runner import run_batch
from dem.kernel.threads import use_threads

use_threads(snakemake.threads)

batch, params = int(snakemake.wildcards.batch), snakemake.params
share = snakemake.input.plan, batch, params.batches, snakemake.output.done
run_batch(*share, snakemake.log[0], snakemake.config, params.kept)
