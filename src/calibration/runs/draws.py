"""Runs that were computed with different software: one sample, made of two draws.

A heap is chaotic, so numba, numpy or a processor of another family give another heap with the same
spec, and the same distribution of heaps (docs/reliability.md). A sample of two such draws is told
of and tested: within each point of a design, runs that differ by their seed alone are compared.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from calibration.engines.templates import macros
from calibration.runs.all_runs import finished
from dem.results import OTHER
from dem.spec import canonical, parse_spec

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
    y, x = y - _mean_of(labels, y), x - _mean_of(labels, x)
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


def _mean_of(labels, values):
    """(n,) mean of the values of the same label."""
    sums, counts = np.bincount(labels, values), np.bincount(labels)
    return (sums / np.maximum(counts, 1))[labels]
