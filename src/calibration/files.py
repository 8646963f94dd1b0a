"""Writing files so that nothing half written is ever found under their name."""

import os
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path):
    """A path beside `path`, of the same suffix, to write to; it takes the place of `path` when the block is done."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial.{os.getpid()}.{path.name}")
    try:
        yield partial
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def write_table(table, path):
    """Write a data frame as CSV."""
    with replacing(path) as partial:
        table.to_csv(partial, index=False)
