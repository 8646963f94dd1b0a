"""Tests that end without a value in a diagnosis: their chance over an emulator's inputs, trained by
the runs (`calibration.inference.chance_of_no_value`), and what the measurements say of them.

The runs' failures are not told apart: a funnel that clogs, an arch and a heap that does not form
all give no value. A run that blew up, or whose grains were still moving when it ended, is none of
them. A silo that arches late has let grains out, and its run reads a flow of these: where the table
has tests that clogged, such a run is one of them (`Experiment.ended_by`).
"""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.inference.chance_of_no_value import Chance
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS
from calibration.study.factors import Factor
from diagnosis.design import multiplied, wanted
from diagnosis.emulator import Moved, coded_off, rows_at_strength
from diagnosis.settings import BASE, Settings, catalogue_of


def train_failures(
    rows: Sequence[dict[str, Any]],
    metrics: Mapping[str, Mapping[str, float] | None],
    settings: Settings,
    factors: Sequence[Factor],
    faults: Collection[str] = (),
) -> dict[tuple[str, str], Chance | Moved]:
    """{(experiment, mechanism): Chance or Moved}, as `diagnosis.emulator.train` its emulators;
    of the experiments of which a run gave no value.

    faults: runs that a fault of the simulation ended. They are no tests, and train nothing."""
    out, known, by_key = {}, catalogue_of(settings, list(settings.experiments)), defaultdict(list)
    for row in rows:
        ran = [name for name in row["run_ids"] if name not in faults]
        if ran:
            by_key[row["experiment"], row["mechanism"]].append(row | {"run_ids": ran})
    failing = {e for (e, _), own in by_key.items() if any(_failed(r, metrics) for r in own)}
    failing = {e for e in failing if (e, BASE) in by_key}
    for (experiment, name), own in by_key.items():
        if experiment not in failing:
            continue
        off = None if name == BASE else coded_off(known[name].strength)
        more = [] if off is None else rows_at_strength(off, by_key[experiment, BASE])
        x = np.array([r["inputs"] for r in own + more])
        failed = [_failed(r, metrics) for r in own + more]
        out[experiment, name] = Chance(x, failed, [len(r["run_ids"]) for r in own + more])
    for experiment, name in wanted(settings, known, failing):
        lever = multiplied(settings, factors, experiment, known.get(name))
        if lever:
            out[experiment, name] = Moved(out[experiment, BASE], lever)  # type: ignore[arg-type, assignment]
    return out  # type: ignore[return-value]


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


@dataclass(frozen=True)
class Outcomes:
    """What tests ended with: c conditions [(experiment, levers)], and how many of `tests` (c,)
    `failed` (c,) to give a value."""

    conditions: list
    failed: np.ndarray
    tests: np.ndarray


def outcomes_of(
    measurements: Sequence[Measurement], failures: Collection[tuple[str, str]]
) -> Outcomes | None:
    """`Outcomes` of the experiments of which a row has an outcome, or None without one.

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
        return None
    failed, tests = np.array(list(counts.values()), float).T  # type: ignore[type-var]
    return Outcomes([(kind, dict(levers)) for kind, levers in counts], failed, tests)
