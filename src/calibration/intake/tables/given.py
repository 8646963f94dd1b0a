"""Tables that people give, by the engine's reader (`dem.tables`), with the errors of a study."""

from contextlib import contextmanager

from calibration.errors import ConfigError
from dem import tables
from dem.errors import InputError


@contextmanager
def _as_ours():
    try:
        yield
    except ConfigError:
        raise
    except InputError as error:
        raise ConfigError(**vars(error)) from None


class Table(tables.Table):
    """`dem.tables.Table` whose methods raise ConfigError."""

    def require(self, *columns):
        """As there."""
        with _as_ours():
            super().require(*columns)

    def number(self, *cell, **options):
        """As there."""
        with _as_ours():
            return super().number(*cell, **options)


def read_rows(path, *options):
    """`dem.tables.read_rows` that raises ConfigError."""
    with _as_ours():
        return tables.read_rows(path, *options)


def read_table(path, check=None):
    """`dem.tables.read_table` that raises ConfigError."""
    with _as_ours():
        return Table(**vars(tables.read_table(path, check)))


def table_of(text, *options):
    """`dem.tables.table_of` that raises ConfigError."""
    with _as_ours():
        return Table(**vars(tables.table_of(text, *options)))
