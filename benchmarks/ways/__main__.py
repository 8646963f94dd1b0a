"""The comparison: made-up studies by the hundred, the same for each way, and a table of results.

    python -m benchmarks.ways OUT [--processes N] [--libraries]

With --libraries those of `libraries.py` are compared too, where they are installed.

Decided before it was run: three smooth responses and two that are not, a study of each for each of
SEEDS, and RUNS. A study's truth and readings are the same for every way and number of runs.
"""

import argparse
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
from calibration.files import write_table

SEEDS = range(20260101, 20260121)
RUNS = (22, 47, 92)
Ways = Mapping[str, Callable[[Bench, int], tuple | None]]
OWN: Ways = {way: partial(answer, way) for way in WAYS}


def trials(seed: int, ways: Ways = OWN) -> pd.DataFrame:
    """Table: response, way, runs, seed, miss [deg], how many of the three parameters their
    intervals hold and how wide the strongest's is; miss is NaN where the way ended with an error.

    ways: {name: function of a bench and a number of runs}."""
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


def main(argv: Sequence[str] | None = None) -> None:
    """Compare the ways and write summary.csv into a folder: a `summary` of the smooth responses and
    one of those that are not, which the column `responses` names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--processes", type=int, default=1, help="seeds at a time")
    parser.add_argument("--libraries", action="store_true", help="kept libraries too")
    args = parser.parse_args(argv)
    ways = {**OWN, **(LIBRARIES if args.libraries else {})}
    with ProcessPoolExecutor(args.processes) as pool:
        table = pd.concat(pool.map(partial(trials, ways=ways), SEEDS))
    rough = table["response"].isin(list(ROUGH))
    found = [summary(table[~rough]).assign(responses="smooth")]
    found += [summary(table[rough]).assign(responses="rough")]
    write_table(pd.concat(found), args.out / "summary.csv")


if __name__ == "__main__":
    main()
