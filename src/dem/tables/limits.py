"""What a file from outside may be at most, before any reader looks at what is in it.

Every reader takes its bytes from `read_limited`, or has `check_file` look at a file that a library
opens by itself. A file that is larger, or that is no plain file, gets one sentence.
"""

import os
import stat
from pathlib import Path
from typing import NamedTuple

from dem.errors import refused
from dem.io.files import rows_of

MB = 1 << 20


class Kind(NamedTuple):
    """A kind of file: how it is called, and the bytes that it may have."""

    words: str
    most: int
    advice: str


KINDS = {
    row["kind"]: Kind(row["words"], int(row["most_kB"]) * 1024, row["advice"])
    for row in rows_of(Path(__file__).with_name("limits.csv"))
}
"""Kind of file -> its limit. A reader says which kind it reads."""

MOST_UNPACKED = 24 * MB  # bytes of all parts of a compressed file together
MOST_ROWS, MOST_COLUMNS, MOST_CELLS = 200_000, 1_000, 500_000
"""Of a table, of whatever kind of file."""
LONGEST_CELL = 4_000  # characters
MOST_TRIANGLES = 300_000
FARTHEST_MM = 1e6  # of a mesh: coordinates are millimetres
MOST_PIXELS = 64_000_000
LONGEST_SOUND_S = 300.0


def check_file(path: str | Path, kind: str) -> int:
    """Size of a file [bytes]. Raises InputError for one that is missing, no plain file (a pipe or a
    device would be read without end) or larger than its kind may be."""
    of = KINDS[kind]
    try:
        found = os.stat(path)
    except (OSError, ValueError) as error:  # a name with a zero in it is a ValueError
        why = getattr(error, "strerror", None) or "the name is none of a file"
        raise refused("unreadable", path=path, why=why) from None
    if stat.S_ISDIR(found.st_mode):
        raise refused("unreadable", path=path, why="Is a directory")
    if not stat.S_ISREG(found.st_mode):
        raise refused("no plain file", path=path, words=of.words)
    if found.st_size > of.most:
        size, limit = f"{found.st_size / MB:.3g} MB", of._asdict() | {"most": of.most / MB}
        raise refused("too large a file", path=path, value=size, **limit)
    return found.st_size


def read_limited(path: str | Path, kind: str) -> bytes:
    """Content of a file. Raises InputError as `check_file`, and where it cannot be read."""
    check_file(path, kind)
    try:
        with open(path, "rb") as stream:
            return stream.read(KINDS[kind].most)
    except OSError as error:
        raise refused("unreadable", path=path, why=error.strerror) from None


def check_cells(path: str | Path, rows: int, columns: int, line: int | None = None) -> None:
    """Raise InputError for a table of more rows, columns or cells than any laboratory's."""
    if rows <= MOST_ROWS and columns <= MOST_COLUMNS and rows * columns <= MOST_CELLS:
        return
    most = {"rows": MOST_ROWS, "columns": MOST_COLUMNS, "cells": MOST_CELLS}
    found = f"{rows} rows, {columns} columns"
    raise refused("too large a table", path=path, line=line, value=found, **most)
