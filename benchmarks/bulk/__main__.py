"""Runs the cases in codes: `python -m benchmarks.bulk FILES OUT CODE...`.

The fall is watched until the sphere is at rest, and with --speed both cases are timed.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import pandas as pd

from benchmarks.bulk.cases import LOOK, Case, drum, penetration
from benchmarks.bulk.codes import CODES, Outcome
from benchmarks.speed.__main__ import made_by, with_rows
from calibration.files import write_table

TIMED = 2
"""Looks at a case whose speed is told."""


def main(words: list[str] | None = None) -> None:
    """Run the codes that are asked for and keep what they give."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bulk")
    files = "folder of MercuryDPM's Drivers/Papers/OSBenchmark"
    parser.add_argument("files", type=Path, help=files)
    parser.add_argument("out", type=Path, help="folder for the results")
    parser.add_argument("code", choices=CODES, nargs="+")
    parser.add_argument(
        "--speed", action="store_true", help="the speeds alone, of runs with nothing beside them"
    )
    args = parser.parse_args(words)
    cases = [penetration(args.files)]
    if args.speed:
        cases = [replace(case, looks=TIMED) for case in (*cases, drum(args.files))]
    for case in cases:
        for code in args.code:
            with tempfile.TemporaryDirectory() as folder:
                outcome = CODES[code](case, Path(folder))
            if not args.speed:
                write_table(pd.DataFrame(outcome.rows), args.out / f"{case.name}.{code}.csv")
            keep(args.out / ("speeds.csv" if args.speed else "runs.csv"), case, code, outcome)


def keep(table: Path, case: Case, code: str, outcome: Outcome) -> None:
    """Write a row of the run to a table, in place of an earlier one of this case and code."""
    row = {"case": case.name, "code": code} | made_by()
    row |= {
        "grains": len(case.radius),
        "time_step_s": case.time_step,
        "simulated_s": round(case.looks * LOOK * case.time_step, 9),
        "processor_s": round(outcome.processor_s, 1),
        "wall_time_s": round(outcome.wall_s, 1),
        "particle_steps_per_s": round(LOOK * sum(outcome.present) / outcome.processor_s),
    }
    rows = with_rows(table, [row])
    write_table(rows.drop_duplicates(["case", "code"], keep="last"), table)


if __name__ == "__main__":
    main()
