"""Small tables (CSV) that a run spec names: header, rows with their lines, numbers."""

import csv
import math
import re
from pathlib import Path

from dem.errors import SpecError


def read_rows(key, path):
    """Header and [(line, cells)]; blank lines and those that begin with # are left out.

    Cells are separated by commas, or else by semicolons or tabs, where a number may have a decimal
    comma. key: of the run spec, for errors. Raises SpecError for what is no table with a row at
    least, and for a row that has not as many cells as the header: a decimal comma beside commas
    would be read as two numbers.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError):
        raise SpecError(key, str(path), "a table that can be read") from None
    kept = [(n, x) for n, x in enumerate(lines, 1) if x.strip() and not x.lstrip().startswith("#")]
    if len(kept) < 2:
        raise SpecError(key, str(path), "a table with a header and a row at least")
    mark = next((m for m in ";\t" if m in kept[0][1]), ",")
    cells = [(n, [c.strip() for c in next(csv.reader([x], delimiter=mark))]) for n, x in kept]
    header = cells[0][1]
    for line, row in cells[1:]:
        if len(row) != len(header):
            allowed = f"{len(header)} cells as in the header, not {len(row)}"
            raise SpecError(key, mark.join(row), allowed, f"{path}, line {line}")
    if mark != ",":
        cells = [(n, [_with_point(key, path, n, c) for c in row]) for n, row in cells]
    return header, cells[1:]


def _with_point(key, path, line, text):
    """A cell with a decimal point for a decimal comma. Raises SpecError for one that can be read in
    two ways, as 1,250 can."""
    if not re.fullmatch(r"-?\d+,\d+", text):
        return text
    if re.fullmatch(r"-?[1-9]\d{0,2},\d{3}", text):
        both = f"{text.replace(',', '.')} or {text.replace(',', '')}, written so"
        raise SpecError(key, text, both, f"{path}, line {line}")
    return text.replace(",", ".")


def read_number(key, path, line, cells, header, column):
    """The number in a row's column. Raises SpecError where there is none."""
    text = cells[header.index(column)]
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SpecError(key, text, f"a number in {column}", f"{path}, line {line}")
    return value
