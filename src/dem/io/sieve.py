"""A size distribution from a table: a sieve curve, whose classes are filled evenly, or single
sizes.

The table is a CSV file with the column `diameter_mm` and one of two others: `passing_percent`, the
share that passes each sieve (from 0 to 100, ascending), or `fraction`, the share of grains of
exactly that size.
"""

from itertools import pairwise

from dem.errors import SpecError
from dem.io.table import read_number, read_rows

KEY = "particles.sizes.file"
DIAMETER, PASSING, FRACTION = "diameter_mm", "passing_percent", "fraction"


def read_sizes(path, by):
    """{by, diameters_mm, fractions} and for a sieve curve `upper_diameters_mm` of a table; by:
    number or mass.

    Raises SpecError naming line, value and what is allowed.
    """
    header, rows = read_rows(KEY, path)
    if DIAMETER not in header or (PASSING in header) == (FRACTION in header):
        allowed = f"the columns {DIAMETER} and either {PASSING} or {FRACTION}"
        raise SpecError(KEY, ", ".join(header), allowed, f"{path}, line 1")
    share = PASSING if PASSING in header else FRACTION
    table = [
        tuple(read_number(KEY, path, n, r, header, c) for c in (DIAMETER, share)) for n, r in rows
    ]
    lines = [n for n, _ in rows]
    if share == FRACTION:
        diameters, fractions = (list(column) for column in zip(*table, strict=True))
        return {"by": by, "diameters_mm": diameters, "fractions": fractions}
    return {"by": by} | _classes(path, lines, table)


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
