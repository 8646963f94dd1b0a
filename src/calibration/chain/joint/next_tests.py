"""What the draws of a posterior expect of every rig: which test to make next, and which
parameter each metric owes its spread."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from calibration.chain.joint.emulators import Emulators
from calibration.inference.joint.next_test import Candidate, rank
from calibration.inference.joint.shares import pushed, shares
from calibration.intake.tables import read_table
from dem.experiments import experiments

if TYPE_CHECKING:
    from calibration.study.config import Config
    from calibration.study.config.joint import JointTarget, MeasuredMean


HOURS = Path(__file__).with_name("laboratory_hours.csv")
LEVEL = 0.95


def next_tests(
    config: Config,
    emulators: Emulators,
    measured: Mapping[JointTarget, MeasuredMean],
    tests: Mapping[str, Sequence[str]],
    draws: np.ndarray,
    machine: str | None = None,
) -> pd.DataFrame:
    """What each metric of each test is expected to tell an hour, the best first; of the metrics of
    `machine` where it is named. tests: {test: metrics}; draws: u (k, d) of the posterior. Raises
    ConfigError for a table of hours that cannot be read."""
    spread = _reading_sd(measured)
    wanted, candidates = None, []
    for rig, metrics in tests.items():
        known = emulators.known(rig, metrics)
        if rig == machine:
            wanted = next(iter(known.values()), None)
            continue
        hours, readings = hours_of(config, rig), config.posterior.readings
        candidates += [
            Candidate(rig, metric, emulator, readings, hours, spread.get((rig, metric), 0.0))
            for metric, emulator in known.items()
        ]
    told = rank(candidates, draws, wanted, config.seed)
    return pd.DataFrame([_row(t, emulators.factors, spread) for t in told])


def metrics_of(
    config: Config, rig: str, measured: Mapping[JointTarget, MeasuredMean]
) -> Sequence[str]:
    """Metrics of a rig that are predicted and could be measured: those that its `metrics` name,
    else its experiment's main one and those that were measured."""
    own = config.tests[rig]
    main = experiments()[own.experiment].targets[:1]
    found = [m for mean in measured.values() for m in mean.of_tests.get(rig, ())]
    return tuple(dict.fromkeys(own.metrics or (*main, *found)))


def hours_of(config: Config, rig: str) -> float:
    """Hours that a rig's readings take: the study's own, else the table's by its experiment.
    Raises ConfigError."""
    if rig in config.posterior.hours:
        return float(config.posterior.hours[rig])
    table = read_table(HOURS)
    rows = {row["experiment"]: (line, row["hours"]) for line, row in table.rows}
    line, hours = rows[config.tests[rig].experiment]
    return float(table.number(line, "hours", hours))


def _reading_sd(measured):
    """{(rig, metric): standard deviation of a reading} of what was measured."""
    found = {}
    for mean in measured.values():
        for *key, sd in zip(mean.tests, mean.metrics, mean.reading_sd, strict=True):
            found[tuple(key)] = float(sd)
    return found


def _row(told, factors, measured):
    c = told.candidate
    row = {"rig": c.rig, "metric": c.metric, "measured": (c.rig, c.metric) in measured}
    row |= {"hours": c.hours, "nat": told.nat, "nat_per_hour": told.nat_per_hour}
    row |= {"low": told.low, "high": told.high, "error": told.error}
    row |= {f"{f.name} left": float(x) for f, x in zip(factors, told.left, strict=True)}
    if told.prediction_left is not None:
        row["prediction left"] = told.prediction_left
    return row


def predictions(
    config: Config, emulators: Emulators, tests: Mapping[str, Sequence[str]], draws: np.ndarray
) -> pd.DataFrame:
    """What the posterior expects of each metric of each test, and which parameter it owes its
    spread. tests: {test: metrics}; draws: u (k, d)."""
    rows = []
    for rig, metrics in tests.items():
        for metric, emulator in emulators.known(rig, metrics).items():
            row = {"rig": rig, "metric": metric}
            rows.append(row | _prediction(emulator, emulators.factors, draws, config.seed))
    return pd.DataFrame(rows)


def _prediction(emulator, factors, draws, seed):
    u, many, run = pushed(emulator, draws, seed)
    mean = emulator.mean(u)[0]
    first, alone = shares(mean, u)
    row = {"mean": float(mean.mean())}
    row |= dict(zip(("low", "high"), _tails(many), strict=True))
    row |= dict(zip(("run_low", "run_high"), _tails(run), strict=True))
    row |= {"sd_parameters": float(mean.std())}
    row |= {f"{f.name} share": float(x) for f, x in zip(factors, first, strict=True)}
    return row | {f"{f.name} alone": float(x) for f, x in zip(factors, alone, strict=True)}


def _tails(values):
    tail = 0.5 * (1.0 - LEVEL)
    return [float(x) for x in np.quantile(values, [tail, 1.0 - tail])]
