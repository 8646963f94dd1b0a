"""Tables that people give, by the engine's reader (`dem.tables`), with the errors of a study."""

from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from calibration.errors import ConfigError
from calibration.intake.guard import in_study
from dem import tables


class SeveralSheetsError(ConfigError):
    """A workbook of which it is not said which sheet is meant; `value` names them."""


@contextmanager
def _as_ours():
    with in_study():
        try:
            yield
        except tables.SeveralSheetsError as error:
            raise SeveralSheetsError(**vars(error)) from None


class Table(tables.Table):
    """`dem.tables.Table` whose methods raise ConfigError."""

    def require(self, *columns: str) -> None:
        """As there."""
        with _as_ours():
            super().require(*columns)

    def number(self, *cell: Any, **options: Any) -> float:
        """As there."""
        with _as_ours():
            return super().number(*cell, **options)


def read_rows(path: str | Path, *options: Any, **named: Any) -> list[tuple[int, list[str]]]:
    """`dem.tables.read_rows` that raises ConfigError."""
    with _as_ours():
        return tables.read_rows(path, *options, **named)


def read_table(
    path: str | Path, check: Callable[..., None] | None = None, sheet: str | None = None
) -> Table:
    """`dem.tables.read_table` that raises ConfigError."""
    with _as_ours():
        return Table(**vars(tables.read_table(path, check, sheet)))


def table_of(text: str, *options: Any) -> Table:
    """`dem.tables.table_of` that raises ConfigError."""
    with _as_ours():
        return Table(**vars(tables.table_of(text, *options)))
