import sys

from calibration.chain.jobs import logged, work_for
from calibration.runs.runner import report_sometimes, run_batch, run_told_batch
from calibration.runs.store import RunStore
from dem.kernel.threads import use_threads

use_threads(snakemake.threads)

config = work_for(snakemake.config).config
share = (
    snakemake.input.plan,
    int(snakemake.wildcards.batch),
    snakemake.params.batches,
    snakemake.output.done,
)
if snakemake.params.failures == "told":
    run_told_batch(*share, snakemake.log[0], snakemake.config)
else:
    store = RunStore(config.runs)
    with logged(snakemake.log[0]):
        run_batch(
            *share,
            snakemake.params.failures,
            # the log takes what the runs say; how far the study is goes to the screen
            tell=lambda: report_sometimes(config, store, sys.__stderr__),
        )
