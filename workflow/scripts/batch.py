import sys

from calibration.chain.jobs import logged, work_for
from calibration.runs.runner import report_sometimes, run_batch, run_kept_batch
from calibration.runs.store import RunStore
from dem.kernel.threads import use_threads

use_threads(snakemake.threads)

batch, batches = int(snakemake.wildcards.batch), snakemake.params.batches
share = snakemake.input.plan, batch, batches, snakemake.output.done
if snakemake.params.kept:
    config = work_for(snakemake.config).config
    store = RunStore(config.runs)
    with logged(snakemake.log[0]):
        # the log takes what the runs say; how far the study is goes to the screen
        run_kept_batch(*share, lambda: report_sometimes(config, store, sys.__stderr__))
else:
    run_batch(*share, snakemake.log[0], snakemake.config)
