"""Tables of a study: those that people give, by the engine's reader (`dem.tables`) with the errors
of a study, what was read said back, and those that a stage wrote."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from calibration.errors import ConfigError
from calibration.intake.guard import in_study
from dem import tables


class Table(tables.Table):
    """`dem.tables.Table` whose methods raise ConfigError."""

    def require(self, *columns: str) -> None:
        """As there."""
        with in_study():
            super().require(*columns)

    def number(self, *cell: Any, **options: Any) -> float:
        """As there."""
        with in_study():
            return super().number(*cell, **options)

    def fault(
        self, line: int | None, column: str | None, reason: str, value: Any = None,
        allowed: str | None = None,
    ) -> ConfigError:  # fmt: skip
        """The error of a cell."""
        return ConfigError(
            reason, path=self.path, line=line, column=column, value=value, allowed=allowed
        )


def read_table(
    path: str | Path, check: Callable[..., None] | None = None, sheet: str | None = None
) -> Table:
    """`dem.tables.read_table` that raises ConfigError."""
    with in_study():
        return Table(**vars(tables.read_table(path, check, sheet)))


def table_of(text: str, *options: Any) -> Table:
    """`dem.tables.table_of` that raises ConfigError."""
    with in_study():
        return Table(**vars(tables.table_of(text, *options)))


def summary(values: ArrayLike, unit: str = "", how: str = "") -> str:
    """One line: `10 values, 26.1° to 28.4°, mean 27.40° ± 0.8° (sd)`, and how the table was
    recognised. One value is said once."""
    values = np.asarray(values, float)
    if len(values) == 1:
        return f"1 value, {values[0]:.4g}{unit}" + (f" ({how})" if how else "")
    digits = _digits(values)
    low, high, mean = (
        f"{values.min():.4g}{unit}",
        f"{values.max():.4g}{unit}",
        f"{values.mean():.{digits}f}{unit}",
    )
    spread = f" ± {values.std(ddof=1):.2g}{unit}"
    text = f"{len(values)} values, {low} to {high}, mean {mean}{spread}"
    return f"{text} ({how})" if how else text


def _digits(values):
    """Decimals that four digits of the largest value take."""
    largest = float(np.abs(values).max())
    return int(np.clip(3 - np.floor(np.log10(largest)), 0, 6)) if largest > 0 else 1


def read_written(path: str | Path, **options: Any) -> pd.DataFrame:
    """Data frame of a CSV file that a stage wrote: commas, points, UTF-8, nothing to recognise;
    options go to pandas. Raises ConfigError where it is none."""
    try:
        return pd.read_csv(path, **options)
    except OSError as error:
        raise ConfigError(f"cannot be read ({error.strerror})", path=path) from None
    except ValueError as error:  # what pandas raises for an empty, ragged or binary file
        reason = f"is not the table that a stage wrote ({str(error).splitlines()[0]})"
        raise ConfigError(reason, path=path, allowed="delete it; it is then made again") from None
