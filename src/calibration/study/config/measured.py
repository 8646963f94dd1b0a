"""What a study is calibrated to: its measured values and what is asked of each response."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING

from calibration.errors import CalibrationError, at_key
from calibration.intake.measurements import read_measured
from calibration.intake.tables import summary
from calibration.statistics.goals import Goal
from calibration.statistics.validate import Stated
from calibration.study.config.tests import spec_of
from calibration.study.matching import NotComparableError, agreeing, sample
from dem.units import behind, unit_of, without_unit

if TYPE_CHECKING:
    import numpy as np

    from calibration.intake.measurements import Measurement, Measurements
    from calibration.study.config.schema import Config, Target


def read_target(config: Config, target: Target | None = None) -> np.ndarray | Stated:
    """(n,) readings of `target`, of the main one unless given, in the metric's unit; a `Stated`
    mean where the table holds nothing else. Raises ConfigError."""
    return _sample(config, read_measured(config.measurements), target or config.target)


def _sample(config, table, target):
    return sample(rows_of(config, table, config.own, target.metric), table.path)


def rows_of(
    config: Config, table: Measurements, name: str, metric: str, but: Collection[str] = ()
) -> list[Measurement]:
    """The measured conditions of a metric that a test is at; levers in `but` do not count. Raises
    ConfigError."""
    experiment, spec = config.tests[name].experiment, spec_of(config, name)
    own = replace(table, conditions=tuple(c for c in table.conditions if c.test in ("", name)))
    return agreeing(own, experiment, without_unit(metric), spec, but)


def is_measured(config: Config, target: Target) -> bool:
    """Whether the table of measurements holds the quantity of a target. Raises ConfigError."""
    table = read_measured(config.measurements)
    return bool(table.of(config.experiment, without_unit(target.metric)))


def read_swept(
    config: Config, name: str, metric: str, but: Collection[str] = ()
) -> list[Measurement]:
    """`rows_of` a test in the table of measurements. Raises ConfigError."""
    return rows_of(config, read_measured(config.measurements), name, metric, but)


def read_back(config: Config) -> list[str]:
    """A sentence for each measured target: what was read of it. Raises ConfigError."""
    table, found = read_measured(config.measurements), []
    for target in (config.target, *config.further_targets):
        name = without_unit(target.metric)
        if table.of(config.experiment, name):
            unit = behind(unit_of(target.metric))
            try:
                said = _said(_sample(config, table, target), unit, table.how)
            except NotComparableError as error:
                said = f"no calibration can use it, only a diagnosis ({error})"
            found.append(f"{table.path}, {name}: {said}")
    return found


def _said(values, unit, how):
    if not isinstance(values, Stated):
        return summary(values, unit, how)
    said = f"{values.value:g}{unit} ± {values.sd:.2g}{unit} (sd), mean of {values.n} values"
    return f"{said} ({how})"


def goals(config: Config) -> list[Goal]:
    """`Goal`s of the target and the further targets, in this order. Raises ConfigError."""
    found = []
    for target in (config.target, *config.further_targets):
        key = f"calibrate.to.{target.metric}"
        if target.low is None or target.high is None:
            raise at_key(
                f"{key}.low" if target.low is None else f"{key}.high",
                "must be given where there are several targets",
                allowed="the value at which the desirability falls to 0",
            )
        wanted = float(read_target(config, target).mean())
        try:
            found.append(Goal(target.low, target.high, wanted))
        except CalibrationError as error:
            raise at_key(key, str(error)) from None
    return found
