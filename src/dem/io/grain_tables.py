"""The sizes of grains and the spheres of one, from tables that a run spec names.

A table of sizes is a sieve curve, whose classes are filled evenly, or single sizes. It has the
column `diameter_mm` and one of two others: `passing_percent`, the share that passes each sieve
(from 0 to 100, ascending), or `fraction`, the share of grains of exactly that size. A table of a
clump has the columns `x_mm`, `y_mm`, `z_mm` and `radius_mm`, one sphere a row.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

from dem.errors import InputError, SpecError
from dem.grains.clump import fault
from dem.tables import read_table

SIZES, CLUMP = "particles.sizes.file", "particles.clump.file"
DIAMETER, PASSING, FRACTION = "diameter_mm", "passing_percent", "fraction"
COLUMNS = ("x_mm", "y_mm", "z_mm", "radius_mm")
NO_ROWS = "a table with a header and a row at least"


@contextmanager
def named_by(key: str) -> Iterator[None]:
    """Say what is wrong with a table with the key of the run spec that names it."""
    try:
        yield
    except InputError as error:
        raise InputError(**vars(error) | {"key": key}) from None


@named_by(SIZES)
def read_sizes(path: str | Path, by: str) -> dict[str, Any]:
    """{by, diameters_mm, fractions} and for a sieve curve `upper_diameters_mm` of a table; by:
    number or mass.

    Raises InputError or SpecError naming line, value and what is allowed.
    """
    table = read_table(path)
    if DIAMETER not in table.header or (PASSING in table.header) == (FRACTION in table.header):
        allowed = f"the columns {DIAMETER} and either {PASSING} or {FRACTION}"
        where = f"{path}, line {table.header_line}"
        raise SpecError(SIZES, ", ".join(table.header), allowed, where)
    share = PASSING if PASSING in table.header else FRACTION
    diameters, shares = table.numbers(DIAMETER), table.numbers(share)
    if not diameters:
        raise SpecError(SIZES, str(path), NO_ROWS)
    if share == FRACTION:
        return {"by": by, "diameters_mm": diameters, "fractions": shares}
    where = [f"{path}, line {n}" for n, _ in table.rows]
    return {"by": by} | _classes(where, diameters, shares)


def _classes(where, diameters, shares):
    """Classes between neighbouring sieves with what lies between them."""
    rows = list(zip(diameters, shares, where, strict=True))
    for (small, less, _), (diameter, passing, line) in pairwise(rows):
        if diameter <= small:
            raise SpecError(SIZES, diameter, f"more than {small:g}: sieves ascend", line)
        if passing < less:
            raise SpecError(SIZES, passing, f"at least {less:g}: what passes ascends", line)
    for (_, passing, line), needed in ((rows[0], 0.0), (rows[-1], 100.0)):
        if abs(passing - needed) > 1e-9:
            raise SpecError(SIZES, passing, f"{needed:g} at this end of the curve", line)
    pairs = [(a, b) for a, b in pairwise(rows) if b[1] > a[1]]
    return {
        "diameters_mm": [a[0] for a, _ in pairs],
        "upper_diameters_mm": [b[0] for _, b in pairs],
        "fractions": [(b[1] - a[1]) / 100.0 for a, b in pairs],
    }


@named_by(CLUMP)
def read_clump(path: str | Path) -> dict[str, list[float]]:
    """{column: values (m,) [mm]} of a table. Raises InputError or SpecError naming line, value and
    what is allowed."""
    table = read_table(path)
    found = {c: table.numbers(c) for c in table.header}
    if sorted(table.header) != sorted(COLUMNS):
        allowed = f"the columns {', '.join(COLUMNS)}, one sphere a row"
        where = f"{path}, line {table.header_line}"
        raise SpecError(CLUMP, ", ".join(table.header), allowed, where)
    if not table.rows:
        raise SpecError(CLUMP, str(path), NO_ROWS)
    wrong = fault(list(zip(*(found[c] for c in COLUMNS), strict=True)))
    if wrong:
        place, value, allowed = wrong
        raise SpecError(CLUMP, value, allowed, f"{path}, line {table.rows[place][0]}")
    return {c: found[c] for c in COLUMNS}
