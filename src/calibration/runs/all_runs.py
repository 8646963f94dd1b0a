"""All runs of a study together: as one file, a row a run with what was varied and what came out,
and whether they are one sample.

The file is netCDF 3, which scipy writes and which xarray, MATLAB, R, Octave and ParaView read. A
heap is chaotic, so numba, numpy or a processor of another family give another heap with the same
spec, and the same distribution of heaps (docs/reliability.md). A sample of two such draws is told
of and tested: within each point of a design, runs that differ by their seed alone are compared.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import scipy

from calibration.engines.templates import macros
from calibration.runs.plans import read_plan
from calibration.runs.store import RunStore
from calibration.study.config import numbers_of
from dem.errors import ResultError
from dem.io.files import replace_file
from dem.results import OTHER
from dem.spec import canonical, parse_spec
from dem.units import in_ascii, unit_of

ABOUT = ("run", "stages", "experiment", "engine")
"""Columns of words; all others are numbers."""

CRATE = "provenance"
"""Folder of a study's results that holds copies of the others."""


def planned(folder: str | Path, plans: Iterable[str | Path] | None = None) -> dict[str, list[str]]:
    """{run name: [stages]} of plans of a study's folder, of all below it unless given."""
    found: dict[str, list[str]] = {}
    for path in sorted(map(Path, Path(folder).rglob("plan.json") if plans is None else plans)):
        stage = path.parent.resolve().relative_to(Path(folder).resolve()).as_posix()
        if stage.startswith(f"{CRATE}/"):
            continue
        for name in read_plan(path):
            found.setdefault(name, []).append(stage)
    return found


def finished(
    folder: str | Path, plans: Iterable[str | Path] | None = None
) -> list[tuple[str, list[str], dict[str, Any]]]:
    """[(run name, [stages], result)] of the `planned` runs that are done and can be trusted;
    `calibration verify` says which of the others are damaged."""
    store, found = RunStore(), []
    for name, stages in planned(folder, plans).items():
        try:
            found.append((name, stages, store.result(name)))
        except ResultError:
            continue
    return found


def runs_table(study: Any, runs: Sequence[tuple[str, list[str], dict[str, Any]]]) -> pd.DataFrame:
    """Table (pandas) of the `finished` runs of a study: name, stages, experiment and engine; the
    dotted keys of the run specs that are numbers and not the same in all runs, and those of the
    factors; the metrics, empty where a run has none of that name; its wall time."""
    rows, specs = [], []
    for name, stages, result in runs:
        rows.append(
            {"run": name, "stages": " ".join(stages), "experiment": result["experiment"]}
            | {"engine": result["engine"]}
            | result["metrics"]
            | {"wall_time_s": result["numerics"].get("wall_time_s")}
        )
        specs.append(numbers_of(result["spec"]))
    levels = pd.DataFrame(specs)
    kept = {f.key for f in study.factors} | {k for k in levels if levels[k].nunique(False) > 1}
    table = pd.DataFrame(rows)
    words = [c for c in ABOUT if c in table]
    parts = [table[words], levels[[k for k in levels if k in kept]], table.drop(columns=words)]
    return pd.concat(parts, axis=1)


def write_netcdf(table: pd.DataFrame, path: str | Path, about: Mapping[str, str]) -> None:
    """Write a table as netCDF 3 with the dimension `run`: numbers as float64 with their unit, words
    as characters. about: {name: text} of the file as a whole."""

    def write(stream):
        with scipy.io.netcdf_file(stream.name, "w", version=2) as file:
            for name, text in about.items():
                setattr(file, name, text)
            file.createDimension("run", len(table))
            for column in table:
                _write_column(file, column, table[column])

    replace_file(path, write)


def _write_column(file, name, values):
    if name not in ABOUT:
        variable = file.createVariable(name, "d", ("run",))
        variable[:] = pd.to_numeric(values).to_numpy(float)
        if unit_of(name):
            variable.units = in_ascii(unit_of(name))
        return
    words = np.array([str(v).encode("ascii", "replace") for v in values], dtype=bytes)
    width = f"characters_of_{name}"
    file.createDimension(width, max(words.dtype.itemsize, 1))
    variable = file.createVariable(name, "c", ("run", width))
    variable._Encoding = "utf-8"  # so readers make words of it
    if len(words):
        variable[:] = words.view("S1").reshape(len(words), -1)


NAMED = ("numba", "numpy", "cpu")
"""Of a run's manifest: what makes another draw; the processor by its family, as LLVM names it."""
DOUBTFUL = 0.05
"""p value, of all metrics of a stage together, below which the draws are said to differ."""

Draw = tuple[str, ...]


@dataclass(frozen=True)
class Difference:
    """Mean of a metric in one draw less that in the other, at equal points: its 95 % limits and the
    p value of no difference, times the number of metrics that were tried."""

    metric: str
    value: float
    low: float
    high: float
    p: float


@dataclass(frozen=True)
class Mixture:
    """Runs of a stage of two draws; draws: {draw: number of runs}, the most frequent one first;
    difference: of the metric that tells them apart best, None where no point has runs of both."""

    stage: str
    draws: dict[Draw, int]
    difference: Difference | None

    def __str__(self):
        text: str = macros("calibration.runs", "said").mixture(self, NAMED, DOUBTFUL)
        return text


def mixtures(
    folder: str | Path, runs: Sequence[tuple[str, list[str], dict[str, Any]]] | None = None
) -> list[Mixture]:
    """`Mixture` of each stage of a study's folder whose runs are of more than one draw. runs: those
    that are `finished`, read unless given."""
    stages: dict[str, list[dict[str, Any]]] = {}
    for _, names, result in finished(folder) if runs is None else runs:
        for stage in names if not result["engine"].startswith(OTHER) else ():
            stages.setdefault(stage, []).append(result)
    return [found for stage, own in sorted(stages.items()) for found in _mixture(stage, own)]


def _mixture(stage: str, results: list[dict[str, Any]]) -> Iterator[Mixture]:
    draws = [draw_of(result) for result in results]
    counts = dict(Counter(draws).most_common())
    if len(counts) > 1:
        first = next(iter(counts))
        second = np.array([draw != first for draw in draws])
        yield Mixture(stage, counts, _difference(results, second))


def draw_of(result: Mapping[str, Any]) -> Draw:
    """Return what of a result's software and processor makes another draw."""
    software = result["manifest"]["software"]
    return tuple(str(software.get(name, "unknown")) for name in NAMED)


def _difference(results, second):
    """`Difference` of the metric with the least p value."""
    points = [canonical(parse_spec(result["spec"] | {"seed": 0})) for result in results]
    names = sorted({name for result in results for name in result["metrics"]})
    found = []
    for name in names:
        values = np.array([result["metrics"].get(name) for result in results], float)
        limits = difference(values, second, points)
        found += [(limits, name)] if limits else []
    if not found:
        return None
    (value, low, high, p), name = min(found, key=lambda one: one[0][3])
    return Difference(name, value, low, high, min(1.0, p * len(found)))


def difference(
    values: np.ndarray, second: np.ndarray, points: Sequence[Any]
) -> tuple[float, float, float, float] | None:
    """(difference, low, high, p) of the mean of the first draw less that of the second, where each
    point has a mean of its own: least squares of value on point and draw, with a t test of the
    draw's coefficient (two draws at one point: Student's). None where no point has runs of both, or
    nothing is left to tell the scatter.

    values : (n,) float64, of one metric, NaN where a run has none
    second : (n,) bool, of the second draw
    points : [n], of the design
    """
    whole = np.isfinite(values)
    labels = np.unique([str(p) for p in points], return_inverse=True)[1][whole]
    y, x = values[whole], second[whole].astype(float)
    y, x = (v - pd.Series(v).groupby(labels).transform("mean").to_numpy() for v in (y, x))
    moment, freedom = float(np.sum(x * x)), len(y) - len(set(labels.tolist())) - 1
    if moment < 1e-12 or freedom < 1:
        return None
    slope = float(np.sum(x * y)) / moment
    error = np.sqrt(float(np.sum((y - slope * x) ** 2)) / freedom / moment)
    if error == 0.0:  # a metric without scatter: equal, or surely not
        return -slope, -slope, -slope, 1.0 if slope == 0.0 else 0.0
    half = float(scipy.stats.t.ppf(0.975, freedom)) * error
    p = float(2.0 * scipy.stats.t.sf(abs(slope) / error, freedom))
    return -slope, -slope - half, -slope + half, p
