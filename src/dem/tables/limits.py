"""What a file from outside may be at most, before any reader looks at what is in it.

Every reader takes its bytes from `read_limited`, or has `check_file` look at a file that a library
opens by itself. A file that is larger, or that is no plain file, gets one sentence.
`check_unpacked` does the same for what lies inside a compressed file.
"""

import os
import re
import stat
import zipfile
from pathlib import Path
from typing import NamedTuple

from dem.errors import InputError
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

MOST_DIGITS = 1_000
"""Of a number in a configuration: Python writes out none of thousands, not even in a message."""
_ENDLESS = re.compile(rb"[0-9A-Fa-f_:xX]{%d,}" % (MOST_DIGITS + 1))
"""Decimal, of another base, or by sixties, as YAML takes them."""
MOST_UNPACKED = 24 * MB
"""Bytes of all parts of a compressed file together."""
MOST_ROWS, MOST_COLUMNS, MOST_CELLS = 200_000, 1_000, 500_000
"""Of a table, of whatever kind of file."""
LONGEST_CELL = 4_000
"""Characters."""
MOST_TRIANGLES = 300_000
FARTHEST_MM = 1e6
"""Of a mesh: coordinates are millimetres."""
MOST_PIXELS = 64_000_000
LONGEST_SOUND_S = 300.0


def check_file(path: str | Path, kind: str) -> int:
    """Size of a file [bytes]. Raises InputError for one that is missing, no plain file (a pipe or a
    device would be read without end) or larger than its kind may be."""
    of = KINDS[kind]
    try:
        found = os.stat(path)
    except (OSError, ValueError) as error:  # a name with a zero in it is a ValueError
        reason = getattr(error, "strerror", None) or "the name is none of a file"
        raise InputError(f"cannot be read ({reason})", path=path) from None
    if stat.S_ISDIR(found.st_mode):
        raise InputError("cannot be read (Is a directory)", path=path)
    if not stat.S_ISREG(found.st_mode):
        raise InputError("is no plain file", path=path, allowed=of.words)
    if found.st_size > of.most:
        raise InputError(
            f"is too large for {of.words}", path=path, value=f"{found.st_size / MB:.3g} MB",
            allowed=f"at most {of.most / MB:g} MB: {of.advice}",
        )  # fmt: skip
    return found.st_size


def read_limited(path: str | Path, kind: str) -> bytes:
    """Content of a file. Raises InputError as `check_file`, and where it cannot be read."""
    check_file(path, kind)
    try:
        with open(path, "rb") as stream:
            data = stream.read(KINDS[kind].most)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", path=path) from None
    if kind == "configuration":
        refuse_long_numbers(data, path)
    return data


def refuse_long_numbers(data: bytes, path: str | Path) -> None:
    """Raise InputError for the text of a configuration with a number of more than MOST_DIGITS."""
    found = _ENDLESS.search(data)
    if found:
        line = data.count(b"\n", 0, found.start()) + 1
        raise InputError(
            "is no number", path=path, value=f"line {line}: {found[0][:40].decode()}...",
            allowed=f"at most {MOST_DIGITS:,} digits",
        )  # fmt: skip


def check_unpacked(packed: zipfile.ZipFile, path: str | Path) -> None:
    """Raise InputError for a compressed file whose parts are larger than MOST_UNPACKED together.
    The library reads no more of a part than it says to hold."""
    size = sum(part.file_size for part in packed.infolist())
    if size > MOST_UNPACKED:
        raise InputError(
            "unpacks to more than a table can be", path=path, value=f"{size / MB:.3g} MB",
            allowed=f"at most {MOST_UNPACKED / MB:g} MB: one table without pictures, or CSV",
        )  # fmt: skip


def check_cells(path: str | Path, rows: int, columns: int, line: int | None = None) -> None:
    """Raise InputError for a table of more rows, columns or cells than any laboratory's."""
    if rows <= MOST_ROWS and columns <= MOST_COLUMNS and rows * columns <= MOST_CELLS:
        return
    raise InputError(
        "is too large a table", path=path, line=line, value=f"{rows} rows, {columns} columns",
        allowed=f"at most {MOST_ROWS:,} rows, {MOST_COLUMNS:,} columns and {MOST_CELLS:,} cells",
    )  # fmt: skip
