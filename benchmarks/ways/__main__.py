"""The comparison: made-up studies by the hundred, the same for each way, and a page of results.

    python -m benchmarks.ways OUT [--repeats N] [--first SEED] [--processes N] [--libraries]

Trials that OUT holds already are not repeated, so that a comparison that was stopped goes on;
those that other statistics made are (`CODE` is in the names of the files).
With --libraries those of `libraries.py` are compared too, where they are installed.

Decided before it was run: three smooth responses and two that are not, REPEATS studies of each from
the seed FIRST on, and RUNS. A study's truth and readings are the same for every way and number of
runs.
"""

import argparse
import hashlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from benchmarks.ways.libraries import LIBRARIES
from benchmarks.ways.truths import ROUGH, TRUTHS, Bench
from benchmarks.ways.ways import WAYS, answer
from calibration.digests import SOURCES
from calibration.files import write_table
from calibration.intake.tables import read_written
from dem.fingerprint import code_of

REPEATS, FIRST = 20, 20260101
RUNS = (22, 47, 92)
CODE = (*Path(__file__).parent.glob("*.py"), *SOURCES.glob("calibration/inference/**/*.py"),
        *SOURCES.glob("calibration/statistics/*.py"))  # fmt: skip
"""The files that decide a trial."""


Ways = Mapping[str, Callable[[Bench, int], tuple | None]]


def trials(seed: int = FIRST, ways: Ways | None = None) -> pd.DataFrame:
    """Table: response, way, runs, seed, miss [deg], how many of the three parameters their
    intervals hold and how wide these are; miss is NaN where the way ended with an error.

    ways: {name: function of a bench and a number of runs}, those of `WAYS` unless given."""
    ways = ways or {way: partial(answer, way) for way in WAYS}
    rows = []
    for response, function in TRUTHS.items():
        for way, answers in ways.items():
            for runs in RUNS:
                bench = Bench.drawn(function, seed)
                row = {"response": response, "way": way, "runs": runs, "seed": seed}
                rows.append(row | _judged(answers(bench, runs), bench))
    return pd.DataFrame(rows)


def _judged(found, bench):
    if found is None:
        return {"miss": np.nan}
    point, low, high = found
    judged = {"miss": bench.missed(point)}
    if low is not None:
        judged["held"] = int(((low <= bench.truth) & (bench.truth <= high)).sum())
        judged["width"] = float(np.mean(high - low))
        judged["width_of_the_strongest"] = float(high[2] - low[2])
    return judged


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Table: way, runs, studies, rmse [deg] with its standard error, coverage [%] with its 95 %
    interval over studies, mean width of the strongest parameter's interval, studies that ended with
    an error."""
    rows = []
    for (way, runs), group in table.groupby(["way", "runs"], sort=False):
        square = group["miss"].dropna() ** 2
        rmse = np.sqrt(square.mean())
        row = {"way": way, "runs": runs, "studies": len(group)}
        row |= {"errors": group["miss"].isna().sum()}
        row |= {"rmse": rmse, "rmse_se": square.std(ddof=1) / np.sqrt(len(square)) / (2 * rmse)}
        if "held" in group and group["held"].notna().any():
            share = group["held"].dropna() / 3.0
            reach = stats.t.ppf(0.975, len(share) - 1) * share.std(ddof=1) / np.sqrt(len(share))
            row |= {"coverage": 100 * share.mean(), "coverage_reach": 100 * reach}
            row["width"] = group["width_of_the_strongest"].mean()
        rows.append(row)
    return pd.DataFrame(rows)


def by_response(table: pd.DataFrame) -> pd.DataFrame:
    """A `summary` of `trials` for the smooth responses together, for the rough ones, and for each
    rough one by itself, which the column `responses` names."""
    rough = table["response"].isin(list(ROUGH))
    groups = {"smooth": ~rough, "rough": rough}
    groups |= {name: table["response"] == name for name in ROUGH}
    return pd.concat(
        [summary(table[rows]).assign(responses=name) for name, rows in groups.items() if rows.any()]
    )


def _made(folder, name, seeds, each, ways=None):
    """Files of the trials, a seed each, named by a digest of CODE without comments, docstrings and
    layout; `each`, a map, makes those that are missing."""
    text = "\n".join(code_of(file.read_text()) for file in sorted(CODE))
    code = hashlib.sha256(text.encode()).hexdigest()[:12]
    files = {seed: folder / f"{name}-{code}-{seed}.csv" for seed in seeds}
    missing = {seed: path for seed, path in files.items() if not path.exists()}
    list(each(partial(_keep, ways), missing, missing.values()))
    return list(files.values())


def _keep(ways, seed, path):
    write_table(trials(seed, ways), path)


def main(argv: Sequence[str] | None = None) -> None:
    """Run what is missing and write trials of each seed and summary.csv into a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--repeats", type=int, default=REPEATS)
    parser.add_argument("--first", type=int, default=FIRST)
    parser.add_argument("--processes", type=int, default=1, help="seeds at a time")
    parser.add_argument("--libraries", action="store_true", help="kept libraries too")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    seeds = range(args.first, args.first + args.repeats)
    with ProcessPoolExecutor(args.processes) as pool:
        files = _made(args.out, "trials", seeds, pool.map)
        if args.libraries:
            files += _made(args.out, "libraries", seeds, pool.map, LIBRARIES)
    found = by_response(pd.concat([read_written(p) for p in files]))
    write_table(found, args.out / "summary.csv")
    print(found.to_string(index=False, float_format="%.2f"))


if __name__ == "__main__":
    main()
