"""Whether the time step decides what the simulations say: the same runs at half of it.

Nature has no time step, so a coarse one is no mechanism that data could show. It is checked at one
condition of each experiment, that in the middle of the measured ones, with the calibrated base
model and the same seeds.
"""

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.runs.simulated import named
from dem.spec import parse_spec
from diagnosis.extend import real_spec, run_scatter
from diagnosis.fit import data_of
from diagnosis.model import Model
from diagnosis.reading_errors import doubt
from diagnosis.rig import Rig
from diagnosis.settings import Settings

LARGE = 0.5
"""Change over the standard error of the measurement, from which on a coarser step would be seen."""

SURE = 2.0  # standard errors of the runs' mean by which the change must stand out of their scatter


def halved(spec: dict[str, Any]) -> dict[str, Any]:
    """Run spec (a mapping) at half its time step."""
    own = parse_spec(spec).numerics
    if own.time_step_s is not None:
        finer = {"time_step_s": 0.5 * own.time_step_s}
    else:
        finer = {"rayleigh_fraction": 0.5 * own.rayleigh_fraction}
    return spec | {"numerics": spec.get("numerics", {}) | finer}


def middles(measurements: Sequence[Measurement]) -> list[int]:
    """Places of the measurements that are checked: the middle one of each experiment by value."""
    out = []
    for kind in dict.fromkeys(m.experiment for m in measurements):
        own = [i for i, m in enumerate(measurements) if m.experiment == kind]
        own.sort(key=lambda i: measurements[i].value)
        out.append(own[len(own) // 2])
    return out


def plan(
    rig: Rig,
    model: Model,
    theta: np.ndarray,
    measurements: Sequence[Measurement],
    seed: int = 95_000,
) -> tuple[list[dict[str, Any]], dict[str, dict[str, Any]]]:
    """Rows [{setting, full, half}] with the names of their runs, and {run id: spec}, of the base
    model at theta (p,)."""
    rows: list[dict[str, Any]] = []
    specs: dict[str, dict[str, Any]] = {}
    for i in middles(measurements):
        seeds = [seed + 1000 * k for k in range(rig.settings.gain_runs)]
        full = [real_spec(rig, model, measurements[i], theta, s) for s in seeds]
        runs = {"full": named(full), "half": named([halved(s) for s in full])}
        specs |= runs["full"] | runs["half"]
        rows.append({"setting": i} | {k: list(v) for k, v in runs.items()})
    return rows, specs


def check(
    settings: Settings,
    measurements: Sequence[Measurement],
    rows: Sequence[dict[str, Any]],
    metrics: Mapping[str, dict[str, float] | None],
) -> list[dict[str, Any]]:
    """[{experiment, levers, value, half, change, uncertain, error, matters}] of what could be run:
    means, their difference, its standard error, that of the measurement."""
    out, errors = [], data_of(measurements).error[0]
    for row in rows:
        m = measurements[row["setting"]]
        metric = cast(str, settings.experiments[m.experiment].metric)
        values = np.array(
            [[(metrics[n] or {}).get(metric, np.nan) for n in row[k]] for k in ("full", "half")]
        )
        if np.isfinite(values).any(1).all():
            out.append(_row(m, values, float(errors[row["setting"]])))
    return out


def _row(measurement, values, error):
    """A row from values (2, r) at the full and the half step."""
    full, half = np.nanmean(values, axis=1)
    uncertain = float(np.hypot(*run_scatter([measurement] * 2, values)))
    uncertain *= float(doubt(max(np.isfinite(values).sum() - 2.0, 1.0)))  # of few runs
    return row_of(measurement, float(full), float(half), uncertain, error)


def row_of(
    measurement: Measurement, full: float, half: float, uncertain: float, error: float
) -> dict[str, Any]:
    """A row of the check from the means at the full and the half step."""
    change = half - full
    return {
        "experiment": measurement.experiment,
        "levers": measurement.levers,
        "value": full,
        "half": half,
        "change": change,
        "uncertain": uncertain,
        "error": error,
        "matters": bool(abs(change) - SURE * uncertain > LARGE * error),
    }
