"""The runs of the atlas: a space-filling design a test, made part by part, and the tables that are
kept of them."""

import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.atlas.rigs import GRAIN, ONE, RIGS, Rig, size_of_unit
from calibration.files import read_json, write_table
from calibration.inference.gaussian_process import GaussianProcess
from calibration.intake.tables import read_written
from calibration.statistics.design import space_filling
from calibration.study.new.study import one_run
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json

PART = 25
RUNS = 1500
"""Runs of one part, which is made at once, and of each test when all are made."""
TRAINED = 600
"""Runs at most, evenly out of those that have a value, by which lengths are trained: the likelihood
takes the cube of their number; the others, a quarter at least, tell what the process is worth."""
KEPT = Path(__file__).with_name("kept")


@cache
def design(rig: Rig) -> list[dict[str, float]]:
    """{input: value} of every run, of which each beginning fills the space of all inputs."""
    return [
        {i.name: _rounded(i.value(u)) for i, u in zip(rig.all_inputs, point, strict=True)}
        for point in space_filling(RUNS, len(rig.all_inputs), 1)
    ]


def _rounded(value):
    return float(f"{value:.4g}")


def one(rig: Rig, at: dict[str, float], seed: int) -> dict[str, Any]:
    """{reading: value without a unit} of a run, and `fault`, why it has none."""
    trial = one_run(rig.spec(at, seed))
    if not trial.metrics:
        return dict.fromkeys(rig.readings) | {"fault": trial.fault.partition(";")[0][:60]}
    values = {m: _rounded(trial.metrics[m] / size_of_unit(m, ONE)) for m in rig.readings}
    return values | {"fault": ""}


def make(name: str, part: int, out: Path) -> None:
    """Make the runs of a part of a test, at the inputs that are kept of them or else the design's,
    and write them as a table with the engine's fingerprint."""
    rig = RIGS[name]
    before = kept(name).set_index("run")[[i.name for i in rig.all_inputs]]
    points = dict(enumerate(design(rig))) | before.to_dict("index")
    numbers = range(part * PART, (part + 1) * PART)
    rows = [{"run": k} | points[k] | one(rig, points[k], k + 1) for k in numbers]
    write_table(pd.DataFrame(rows).assign(engine=engine_fingerprint()), out)


@cache
def kept(name: str) -> pd.DataFrame:
    """The kept table of a test: inputs and readings, a row a run; without rows where none is."""
    if (path := KEPT / f"{name}.csv").is_file():
        return read_parts([path])
    return pd.DataFrame(columns=["run", *(i.name for i in RIGS[name].all_inputs), "engine"])


@cache
def trained(name: str) -> dict[str, dict[str, Any]]:
    """{reading: what the kept runs of a test have trained}: `process`, what is known of it, and
    `wider`, how many times the errors that it states are those of runs which had no part in that,
    of dry grains and of grains that stick (1 at least)."""
    return read_json(KEPT / f"{name}.json")


def coded(rig: Rig, table: pd.DataFrame) -> np.ndarray:
    """Coded inputs (n, D) of runs of a test."""
    return np.column_stack([i.coded(table[i.name].to_numpy(float)) for i in rig.all_inputs])


def missing(name: str) -> list[int]:
    """Parts of a test whose runs are not kept of this engine."""
    done = set(kept(name).loc[kept(name)["engine"] == engine_fingerprint(), "run"])
    return [k for k in range(RUNS // PART) if not done.issuperset(range(k * PART, (k + 1) * PART))]


def keep(name: str, parts: Sequence[Path], out: Path) -> None:
    """Write the parts of a test, with what is kept already of this engine, as its kept table, and
    what its processes learn of it beside."""
    table, before, rig = read_parts(parts), kept(name), RIGS[name]
    own = (before["engine"] == engine_fingerprint()) & ~before["run"].isin(table["run"])
    table = pd.concat([before[own], table]).sort_values("run")
    x = coded(rig, table)
    found = {metric: _trained(x, table[metric].to_numpy(float)) for metric in rig.readings}
    write_table(table, out / f"{name}.csv")
    write_json(out / f"{name}.json", found)


def _trained(x, y):
    """What is `trained` of a reading y (n,) at inputs x (n, D); nan where a run gave none."""
    x, y = x[np.isfinite(y)], y[np.isfinite(y)]
    own = np.linspace(0, len(y) - 1, min(TRAINED, int(0.75 * len(y)))).astype(int)
    known = GaussianProcess().fit(x[own], y[own]).known
    error, sd = GaussianProcess().fit(x, y, known).left_out()
    rest = np.delete(error / sd, own)
    sticky = np.delete(x[:, [i.of for i in GRAIN].index("bond")] > 0.0, own)
    wider = [float(np.sqrt(np.mean(rest[sticky == s] ** 2))) for s in (False, True)]
    return {"process": known, "wider": [max(1.0, times) for times in wider]}


def read_parts(parts: Sequence[Path]) -> pd.DataFrame:
    """The runs of tables that `make` or `keep` wrote."""
    return pd.concat([read_written(p, keep_default_na=False, na_values=[""]) for p in parts])


SAMPLE = 2
"""Parts of a test that are made again where the engine has changed."""
STANDS = 3.0
"""Standard errors of their mean difference up to which runs of two engines count as alike."""


def compare(name: str, parts: Sequence[Path], out: Path) -> None:
    """Hold runs that were made again against the kept ones and write a row a reading: their mean
    difference, its standard error by the pairs' own scatter, and whether the table stands."""
    new = read_parts(parts).set_index("run")
    old, rows = kept(name).set_index("run"), []
    for metric in RIGS[name].readings:
        apart = (new[metric] - old[metric]).dropna()
        mean, error = apart.mean(), apart.std(ddof=1) / len(apart) ** 0.5
        stands = bool(abs(mean) <= STANDS * error)
        rows.append({"test": name, "metric": metric, "pairs": len(apart), "difference": mean,
                     "error": error, "stands": stands})  # fmt: skip
    failed = int((new["fault"].notna() != old.loc[new.index, "fault"].notna()).sum())
    write_table(pd.DataFrame(rows).assign(without_value_in_one=failed), out)


if __name__ == "__main__":
    task, name, *given, out = sys.argv[1:]
    if task == "make":
        make(name, int(given[0]), Path(out))
    else:
        {"keep": keep, "compare": compare}[task](name, [Path(p) for p in given], Path(out))
