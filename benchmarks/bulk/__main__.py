"""Runs cases in codes: `python -m benchmarks.bulk FILES OUT`."""

import argparse
import sys
import tempfile
from pathlib import Path

import pandas as pd

from benchmarks.bulk.cases import CASES, Case
from benchmarks.bulk.codes import CODES, Outcome
from benchmarks.speed.__main__ import made_by, with_rows
from calibration.files import write_table
from dem.errors import DemError

RUNS, SPEEDS = "runs.csv", "speeds.csv"


def main(words: list[str] | None = None) -> int:
    """Run the cases that are asked for; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bulk")
    files = "folder of MercuryDPM's Drivers/Papers/OSBenchmark"
    parser.add_argument("files", type=Path, help=files)
    parser.add_argument("out", type=Path, help="folder for the results")
    parser.add_argument("--case", choices=CASES, action="append", required=True)
    parser.add_argument("--code", choices=CODES, action="append", required=True)
    parser.add_argument(
        "--speed", action="store_true", help="keep the speed alone, of a run with nothing beside it"
    )
    parser.add_argument("--seconds", type=float, default=float("inf"), help="of simulated time")
    args = parser.parse_args(words)
    try:
        for name in args.case:
            case = CASES[name](args.files).shortened(args.seconds)
            for code in args.code:
                with tempfile.TemporaryDirectory() as folder:
                    outcome = CODES[code](case, Path(folder))
                keep(args.out, case, code, outcome, SPEEDS if args.speed else RUNS)
    except DemError as fault:
        print(fault, file=sys.stderr)
        return 1
    return 0


def keep(out: Path, case: Case, code: str, outcome: Outcome, table: str = RUNS) -> None:
    """Write a row of the run to a table, in place of an earlier one of this case and code; with a
    row of RUNS what was watched, to <case>.<code>.csv."""
    if table == RUNS:
        write_table(pd.DataFrame(outcome.rows), out / f"{case.name}.{code}.csv")
    row = {"case": case.name, "code": code} | made_by()
    row |= {
        "grains": case.grains,
        "time_step_s": case.time_step,
        "simulated_s": round(outcome.steps * case.time_step, 9),
        "processor_s": round(outcome.processor_s, 1),
        "wall_time_s": round(outcome.wall_s, 1),
        "particle_steps_per_s": round(outcome.particle_steps / outcome.processor_s),
    }
    rows = with_rows(out / table, [row])
    write_table(rows.drop_duplicates(["case", "code"], keep="last"), out / table)


if __name__ == "__main__":
    sys.exit(main())
