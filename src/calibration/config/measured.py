"""What a study is calibrated to: its measured values and what is asked of each response."""

import numpy as np

from calibration.errors import CalibrationError, ConfigError
from calibration.plausible import plausible_numbers
from calibration.statistics.goals import Goal
from calibration.tables import read_table, summary
from dem.units import behind, unit_of


def read_target(config, target=None):
    """(n,) measured values of `target`, of the main one unless given, in the metric's unit. Raises
    ConfigError."""
    target = target or config.target
    table = read_table(target.file)
    if target.column not in table.header:
        raise ConfigError(
            "no such column",
            path=table.path,
            line=table.header_line,
            key="target.column" if target is config.target else f"column of {target.metric}",
            value=target.column,
            allowed=", ".join(table.header),
        )
    values = plausible_numbers(table, target.column, target.metric)
    if len(values) < 2:
        raise ConfigError("needs at least two values to have a spread", path=table.path)
    return np.array(values)


def read_back(config):
    """A sentence for each table of measured values: what was read from it. Raises ConfigError."""
    found = []
    for target in (config.target, *config.further_targets):
        if target.file is not None:
            how, unit = read_table(target.file).how, behind(unit_of(target.metric))
            text = summary(read_target(config, target), unit, how)
            found.append(f"{target.file}, {target.column}: {text}")
    return found


def goals(config, file="config"):
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
        kind = "target" if n == 0 else target.goal
        wanted = float(read_target(config, target).mean()) if kind == "target" else None
        try:
            found.append(
                Goal(kind, target.low, target.high, wanted, target.weight, target.importance)
            )
        except CalibrationError as error:
            raise ConfigError(str(error), path=file, key=key) from None
    return found
