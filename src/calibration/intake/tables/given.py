"""Tables that people give, by the engine's reader (`dem.tables`), with the errors of a study."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

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
