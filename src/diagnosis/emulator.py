"""The emulators of a diagnosis, trained by DEM runs for one experiment under one law: a `Response`
of the reading, and the chance that a test ends without a value.

What is known of the experiment transforms the reading, so that a nearly linear rest is learned:
log(rebound / height) is 2 log e, tan(sliding angle) is mu, shear stress over normal stress is a
friction.

The runs' failures are not told apart: a funnel that clogs, an arch and a heap that does not form
all give no value (`calibration.inference.chance_of_no_value`). A run that blew up, or whose grains
were still moving when it ended, is none of them. A silo that arches late has let grains out, and
its run reads a flow of these: where the table has tests that clogged, such a run is one of them
(`Experiment.ended_by`).
"""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from calibration.inference.chance_of_no_value import Chance
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS, QUANTITIES
from dem.experiments.declare import Plain
from diagnosis.catalogue import Mechanism, Strength
from diagnosis.design import inputs_of
from diagnosis.response import Response, WithMechanism
from diagnosis.rig import Rig
from diagnosis.settings import BASE, Settings, log_span


class Logarithm(Plain):
    """A quantity that is positive and whose spread goes with its value."""

    def __init__(self, least: float) -> None:
        self.least = least

    def forward(self, value: np.ndarray, levers: Mapping[str, Any]) -> np.ndarray:
        """Logarithm of the value; that of `least` [the quantity's unit] for what is below."""
        return np.log(np.maximum(value, self.least))

    def inverse(self, z: np.ndarray, levers: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Value and its derivative."""
        value = np.exp(z)
        return value, value


def scale_of(experiment: str) -> Plain:
    """Return what an emulator learns of an experiment's quantity: its own scale where it declares
    one.

    Without one, the logarithm of what is known to a share of itself: an error of the emulator that
    is alike everywhere would else drown the small values."""
    quantity = QUANTITIES[experiment]
    if quantity.relative and type(quantity.scale) is Plain:
        return Logarithm(quantity.least)
    return quantity.scale


LEAST = 2
"""Finished runs of a mechanism that train it: what they do not tell is in the
variance, and strong cohesion clogs a silo at most strengths."""


def train(
    rows: Sequence[dict[str, Any]],
    metrics: Mapping[str, Mapping[str, float] | None],
    rig: Rig,
    catalogue: Mapping[str, Mechanism],
) -> tuple[dict[tuple[str, str], Any], list[dict[str, Any]]]:
    """{(experiment, mechanism): Response} and a table of their errors.

    rows: of `design.plan`; metrics: {run id: metrics or None}. A run that failed trains nothing
    and is counted. Runs of the base model train a mechanism too, at the strength at which it does
    nothing.
    """
    emulators, table = {}, []  # type: ignore[var-annotated]
    planned = defaultdict(list)  # type: ignore[var-annotated]
    for row in rows:
        runs = [(row["inputs"], metrics[n]) for n in row["run_ids"]]
        planned[row["experiment"], row["mechanism"]] += runs
    for key, runs in planned.items():
        own = [(inputs, found) for inputs, found in runs if found is not None]
        row = {"experiment": key[0], "mechanism": key[1], "runs": len(own)}
        row["failed"] = len(runs) - len(own)
        if len(own) < (0.5 * len(runs) if key[1] == BASE else LEAST):
            table.append(row)
            continue
        base = emulators.get((key[0], BASE))
        names = inputs_of(rig.settings, rig.factors, *key)
        x, experiment = np.array([inputs for inputs, _ in own]), rig.settings.experiments[key[0]]
        ranges: Any = experiment.levers  # `setup` fills it in
        columns = {n: names.index(n) for n in ranges}
        levers = {
            n: np.array([log_span(low, high, s) for s in x[:, columns[n]]])
            for n, (low, high) in ranges.items()
        }
        value = np.array([found[experiment.metric] for _, found in own])  # type: ignore[index]
        z = scale_of(key[0]).forward(value, levers)
        if key[1] == BASE:
            emulators[key] = Response(x, z, list(columns.values()))
        elif base is None:
            continue  # most of the base model's runs failed, which the table says
        else:
            emulators[key] = WithMechanism(base, x, z, coded_off(catalogue[key[1]].strength))
        table.append(row | {n: getattr(emulators[key], n) for n in ("error", "scatter", "spread")})
    return emulators, table


def coded_off(strength: Strength) -> float | None:
    """Coded strength at which a mechanism does nothing; None where its range does not reach so
    far."""
    nowhere = strength.off is None and (strength.log or strength.low != 0.0)
    return None if nowhere else strength.weakest


def train_failures(
    rows: Sequence[dict[str, Any]],
    metrics: Mapping[str, Mapping[str, float] | None],
    catalogue: Mapping[str, Mechanism],
    faults: Collection[str] = (),
) -> dict[tuple[str, str], Chance]:
    """{(experiment, mechanism): Chance}, as `diagnosis.emulator.train` its emulators;
    of the experiments of which a run gave no value.

    faults: runs that a fault of the simulation ended. They are no tests, and train nothing."""
    out, by_key = {}, defaultdict(list)
    for row in rows:
        ran = [name for name in row["run_ids"] if name not in faults]
        if ran:
            by_key[row["experiment"], row["mechanism"]].append(row | {"run_ids": ran})
    failing = {e for (e, _), own in by_key.items() if any(_failed(r, metrics) for r in own)}
    failing = {e for e in failing if (e, BASE) in by_key}
    for (experiment, name), own in by_key.items():
        if experiment not in failing:
            continue
        off = None if name == BASE else coded_off(catalogue[name].strength)
        # rows of the base model are its at that strength, but for levers beyond the range
        base = by_key[experiment, BASE] if off is not None else []
        inside = [r for r in base if 0.0 <= min(r["inputs"]) and max(r["inputs"]) <= 1.0]
        more = [r | {"inputs": [*r["inputs"], off]} for r in inside]
        x = np.array([r["inputs"] for r in own + more])
        failed = [_failed(r, metrics) for r in own + more]
        out[experiment, name] = Chance(x, failed, [len(r["run_ids"]) for r in own + more])
    return out


def as_tests(
    settings: Settings,
    specs: Mapping[str, Mapping[str, Any]],
    metrics: Mapping[str, dict[str, float] | None],
) -> dict[str, dict[str, float] | None]:
    """{run id: metrics or None} of runs {run id: spec}, None also where the metric `ended_by` of
    the run's experiment says that it ended without a value."""
    out = {}
    for name, found in metrics.items():
        ended = settings.experiments[specs[name]["experiment"]].ended_by
        out[name] = None if found and ended and found.get(ended) else found
    return out


def _failed(row, metrics):
    return sum(metrics[name] is None for name in row["run_ids"])


def outcomes_of(
    measurements: Sequence[Measurement], failures: Collection[tuple[str, str]]
) -> tuple[list[tuple[str, dict]], np.ndarray | None, np.ndarray | None]:
    """What tests ended with, of the experiments of which a row has an outcome: c conditions
    [(experiment, levers)], and how many failed (1, c) to give a value, of how many (c,); None of
    both without one.

    Readings count as tests that gave a value, but only beside outcomes of their experiment: a table
    without any may leave out what failed."""
    trained = {experiment for experiment, _ in failures}
    valued = {m.experiment for m in measurements if not m.outcome}
    kinds = {m.experiment for m in measurements if m.outcome} & trained & valued
    counts = {}  # type: ignore[var-annotated]
    for m in measurements:
        if m.experiment in kinds:
            levers = {k: v for k, v in m.levers.items() if LEVERS[k].place}
            row = counts.setdefault((m.experiment, tuple(sorted(levers.items()))), [0, 0])
            row[0] += m.n if m.outcome else 0
            row[1] += m.n
    if not counts:
        return [], None, None
    failed, tests = np.array(list(counts.values()), float).T  # type: ignore[type-var]
    return [(kind, dict(levers)) for kind, levers in counts], failed[None], tests
