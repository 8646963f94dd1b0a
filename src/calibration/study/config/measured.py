"""What a study is calibrated to: its measured values and what is asked of each response."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from calibration.errors import CalibrationError, ConfigError
from calibration.intake.measurements import read_measured
from calibration.intake.quantities import quantity_name
from calibration.intake.tables import summary
from calibration.statistics.goals import Goal
from calibration.statistics.stated import Stated
from calibration.study.config.specs import bench_run, point_spec
from calibration.study.matching import NotComparableError, agreeing, sample
from dem.spec import parse_spec
from dem.units import behind, unit_of

if TYPE_CHECKING:
    import numpy as np

    from calibration.intake.measurements import Measurement
    from calibration.study.config.schema import Config, Target


def read_target(config: Config, target: Target | None = None) -> np.ndarray | Stated:
    """(n,) readings of `target`, of the main one unless given, in the metric's unit; a `Stated`
    mean where the table holds nothing else. Raises ConfigError."""
    return _sample(config, read_measured(config.measurements), target or config.target)


def _sample(config, table, target):
    spec = parse_spec(point_spec(config.run, config.experiment, {}, 1))
    found = agreeing(table, config.experiment, quantity_name(target.metric), spec)
    return sample(found, table.path)


def is_measured(config: Config, target: Target) -> bool:
    """Whether the table of measurements holds the quantity of a target. Raises ConfigError."""
    table = read_measured(config.measurements)
    return bool(table.of(config.experiment, quantity_name(target.metric)))


def read_bench(
    config: Config, test: str, metric: str, but: Collection[str] = ()
) -> list[Measurement]:
    """The measured conditions of a metric that the rig of a bench test is at; levers in `but` are
    swept. Raises ConfigError."""
    run = bench_run(config, getattr(config.bench, test).run)
    table, spec = read_measured(config.measurements), parse_spec(point_spec(run, test, {}, 1))
    return agreeing(table, test, quantity_name(metric), spec, but)


def read_back(config: Config) -> list[str]:
    """A sentence for each measured target: what was read of it. Raises ConfigError."""
    table, found = read_measured(config.measurements), []
    for target in (config.target, *config.further_targets):
        name = quantity_name(target.metric)
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


def goals(config: Config, file: str = "config") -> list[Goal]:
    """`Goal`s of the target and the further targets, in this order. Raises ConfigError."""
    found = []
    for n, target in enumerate((config.target, *config.further_targets)):
        key = "target" if n == 0 else f"further_targets.{n - 1}"
        if target.low is None or target.high is None:
            raise ConfigError(
                "must be given where there are several targets",
                path=file,
                key=f"{key}.low" if target.low is None else f"{key}.high",
                allowed="the value at which the desirability falls to 0",
            )
        kind = "target" if n == 0 else target.goal  # type: ignore[attr-defined]  # of the further ones
        wanted = float(read_target(config, target).mean()) if kind == "target" else None
        try:
            found.append(
                Goal(kind, target.low, target.high, wanted, target.weight, target.importance)
            )
        except CalibrationError as error:
            raise ConfigError(str(error), path=file, key=key) from None
    return found
