"""Rates of the diagnosis: `python -m benchmarks.rates TRIAL run` goes on where it was cut off."""

import argparse

from benchmarks.rates import bulk_tables, engine_tables, single_grains
from benchmarks.rates.strangers import campaign

TRIALS = {
    trial.word: trial
    for trial in (
        single_grains.TRIAL, campaign.TRIAL, campaign.GAINS, bulk_tables.TRIAL, engine_tables.TRIAL,
    )
}  # fmt: skip

if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rates", description=__doc__)
    parser.add_argument("trial", choices=TRIALS)
    what = "diagnose what is not kept; write the rates into the page"
    parser.add_argument("what", choices=("run", "table"), help=what)
    args = parser.parse_args()
    trial = TRIALS[args.trial]
    if args.what == "run":
        trial.run()
    else:  # the gains stand in the strangers' table
        (campaign.TRIAL if trial is campaign.GAINS else trial).show()
