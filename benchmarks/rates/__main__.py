"""Rates of the diagnosis: `python -m benchmarks.rates TRIAL run` goes on where it was cut off."""

import argparse
import json
import sys

from benchmarks.rates import bulk_tables, engine_tables, single_grains
from benchmarks.rates.strangers import campaign

TRIALS = {
    trial.word: trial
    for trial in (
        single_grains.TRIAL, campaign.TRIAL, campaign.GAINS, bulk_tables.TRIAL, engine_tables.TRIAL,
    )
}  # fmt: skip


def main(words: list[str] | None = None) -> int:
    """Return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rates", description=__doc__)
    parser.add_argument("trial", choices=TRIALS)
    parser.add_argument(
        "what",
        choices=("run", "table", "list", "try"),
        help="diagnose what is not kept; write the rates into the page; name the cases; diagnose "
        "one and keep nothing",
    )
    parser.add_argument("case", nargs="?", help="of `try`, as `list` writes it")
    args = parser.parse_args(words)
    trial = TRIALS[args.trial]
    named = {", ".join(map(str, trial.name(case).values())): case for case in trial.cases()}
    if args.what == "run":
        trial.run()
    elif args.what == "table":  # the gains stand in the strangers' table
        (campaign.TRIAL if trial is campaign.GAINS else trial).show()
    elif args.what == "list":
        print(*named, sep="\n")
    elif args.case not in named:
        parser.error(f"{args.case}: no case of {args.trial}; `list` names them")
    else:
        print(json.dumps(trial.judged(named[args.case]), indent=1, default=str))
    return 0


if __name__ == "__main__":
    sys.exit(main())
