"""The one reader of tables that people give: measured values, factors, designs, sieve curves.

`read_table` takes what a spreadsheet or an instrument saved: it recognises encoding, separator and
decimal mark, reads workbooks, and refuses what can be read in two ways.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from dem.errors import InputError
from dem.tables.table import Table, read_table, table_of

__all__ = ["Table", "named_by", "read_table", "table_of"]


@contextmanager
def named_by(key: str) -> Iterator[None]:
    """Return what is wrong with a table that a run spec names is said with the spec's key."""
    try:
        yield
    except InputError as error:
        raise InputError(**vars(error) | {"key": key}) from None
