"""A size distribution from a table: a sieve curve, whose classes are filled evenly, or single
sizes.

The table is a CSV file with the column `diameter_mm` and one of two others: `passing_percent`, the
share that passes each sieve (from 0 to 100, ascending), or `fraction`, the share of grains of
exactly that size.
"""

import csv
from itertools import pairwise
from pathlib import Path

from dem.errors import SpecError

KEY = "particles.sizes.file"
DIAMETER, PASSING, FRACTION = "diameter_mm", "passing_percent", "fraction"


def read_sizes(path, by):
    """{by, diameters_mm, fractions} and for a sieve curve `upper_diameters_mm` of a table; by:
    number or mass.

    Raises SpecError naming line, value and what is allowed.
    """
    header, rows = _rows(path)
    if DIAMETER not in header or (PASSING in header) == (FRACTION in header):
        allowed = f"the columns {DIAMETER} and either {PASSING} or {FRACTION}"
        raise SpecError(KEY, ", ".join(header), allowed, f"{path}, line 1")
    share = PASSING if PASSING in header else FRACTION
    table = [
        (_number(path, n, r, header, DIAMETER), _number(path, n, r, header, share)) for n, r in rows
    ]
    lines = [n for n, _ in rows]
    if share == FRACTION:
        diameters, fractions = (list(column) for column in zip(*table, strict=True))
        return {"by": by, "diameters_mm": diameters, "fractions": fractions}
    return {"by": by} | _classes(path, lines, table)


def _rows(path):
    """Header and [(line, cells)]; blank lines and those that begin with # are left out."""
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError):
        raise SpecError(KEY, str(path), "a table that can be read") from None
    kept = [(n, x) for n, x in enumerate(lines, 1) if x.strip() and not x.lstrip().startswith("#")]
    if len(kept) < 2:
        raise SpecError(KEY, str(path), "a table with a header and a row at least")
    cells = [(n, [c.strip() for c in next(csv.reader([x]))]) for n, x in kept]
    return cells[0][1], cells[1:]


def _number(path, line, cells, header, column):
    place = header.index(column)
    text = cells[place] if place < len(cells) else ""
    try:
        return float(text)
    except ValueError:
        raise SpecError(KEY, text, f"a number in {column}", f"{path}, line {line}") from None


def _classes(path, lines, table):
    """Classes between neighbouring sieves with what lies between them."""
    for k, (line, (diameter, passing)) in enumerate(zip(lines, table, strict=True)):
        where = f"{path}, line {line}"
        if k and diameter <= table[k - 1][0]:
            raise SpecError(KEY, diameter, f"more than {table[k - 1][0]:g}: sieves ascend", where)
        if k and passing < table[k - 1][1]:
            raise SpecError(
                KEY, passing, f"at least {table[k - 1][1]:g}: what passes ascends", where
            )
    for passing, line, needed in ((table[0][1], lines[0], 0.0), (table[-1][1], lines[-1], 100.0)):
        if abs(passing - needed) > 1e-9:
            raise SpecError(
                KEY, passing, f"{needed:g} at this end of the curve", f"{path}, line {line}"
            )
    pairs = [(a, b) for a, b in pairwise(table) if b[1] > a[1]]
    return {
        "diameters_mm": [a[0] for a, _ in pairs],
        "upper_diameters_mm": [b[0] for _, b in pairs],
        "fractions": [(b[1] - a[1]) / 100.0 for a, b in pairs],
    }
