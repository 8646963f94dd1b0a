"""Small tables (CSV) that a run spec names: header, rows with their lines, numbers."""

import csv
import math
from pathlib import Path

from dem.errors import SpecError


def read_rows(key, path):
    """Header and [(line, cells)]; blank lines and those that begin with # are left out.

    key: of the run spec, for errors. Raises SpecError for what is no table with a row at least.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError):
        raise SpecError(key, str(path), "a table that can be read") from None
    kept = [(n, x) for n, x in enumerate(lines, 1) if x.strip() and not x.lstrip().startswith("#")]
    if len(kept) < 2:
        raise SpecError(key, str(path), "a table with a header and a row at least")
    cells = [(n, [c.strip() for c in next(csv.reader([x]))]) for n, x in kept]
    return cells[0][1], cells[1:]


def read_number(key, path, line, cells, header, column):
    """The number in a row's column. Raises SpecError where there is none."""
    place = header.index(column)
    text = cells[place] if place < len(cells) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SpecError(key, text, f"a number in {column}", f"{path}, line {line}")
    return value
