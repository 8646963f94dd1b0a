"""One cached run inside the workflow: its log, its failure in a sentence, and the campaign's progress."""

import os
import sys
import time
from pathlib import Path

from calibration.campaign import progress
from calibration.config import Config
from dem.errors import DemError
from dem.run import run
from dem.spec import parse_spec


def run_logged(spec, out, log, config):
    """Run `spec` (a mapping) into folder `out` and write its progress to `log`.

    A failed run says which point failed, why, and where its log is, and ends the job with status 1.
    """
    started = time.time()
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with open(log, "w") as stream:

        def note(fraction, text):
            stream.write(f"{time.time() - started:8.1f} s  {100 * fraction:3.0f} %  {text}\n")
            stream.flush()

        try:
            result = run(parse_spec(spec), out, note)
        except DemError as error:
            stream.write(f"failed: {error}\n")
            print(
                f"run {Path(out).name} failed: {error}\n  its spec: {spec}\n  its log:  {log}",
                file=sys.stderr,
            )
            sys.exit(1)
        stream.write(f"done: {result['metrics']}\n")
    report(Config.model_validate(config))


def report(config):
    """Print how far the campaign is; the runs of stages not yet planned are counted as expected."""
    done, todo, mean = progress(config)
    cores = int(os.environ.get("CAMPAIGN_CORES", 1))
    minutes = todo * mean / cores / 60 if mean else 0.0
    left = f"; about {minutes:.1f} min left on {cores} cores" if mean and todo else ""
    print(f"{config.name}: {' · '.join(done)}{left}", file=sys.stderr, flush=True)
