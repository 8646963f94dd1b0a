"""What a study is calibrated to: its measured values and what is asked of each response."""

from pathlib import Path

import pandas as pd

from calibration.errors import CalibrationError, ConfigError
from calibration.statistics.goals import Goal


def read_target(config, target=None):
    """(n,) measured values of `target`, of the main one unless given. Raises ConfigError."""
    target = target or config.target
    path = Path(target.file)
    try:
        table = pd.read_csv(path, comment="#")
    except OSError as error:
        raise ConfigError(f"cannot be read ({error.strerror})", path=path) from None
    if target.column not in table:
        raise ConfigError(
            "no such column",
            path=path,
            key="target.column" if target is config.target else f"column of {target.metric}",
            value=target.column,
            allowed=", ".join(table.columns),
        )
    values = pd.to_numeric(table[target.column], errors="coerce")
    if values.isna().any():
        line = int(values.isna().to_numpy().nonzero()[0][0]) + 2
        raise ConfigError("is not a number", path=path, line=line, column=target.column)
    if len(values) < 2:
        raise ConfigError("needs at least two values to have a spread", path=path)
    return values.to_numpy()


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
