"""The spheres of a grain from a table: the columns `x_mm`, `y_mm`, `z_mm` and
`radius_mm`, one sphere a row."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dem.errors import SpecError
from dem.grains.clump import fault
from dem.tables import named_by, read_table

if TYPE_CHECKING:
    from pathlib import Path


KEY = "particles.clump.file"
COLUMNS = ("x_mm", "y_mm", "z_mm", "radius_mm")


def read_clump(path: str | Path) -> dict[str, list[float]]:
    """{column: values (m,) [mm]} of a table. Raises InputError or SpecError naming line, value and
    what is allowed."""
    with named_by(KEY):
        table = read_table(path)
        found = {c: table.numbers(c) for c in table.header}
    if sorted(table.header) != sorted(COLUMNS):
        allowed = f"the columns {', '.join(COLUMNS)}, one sphere a row"
        where = f"{path}, line {table.header_line}"
        raise SpecError(KEY, ", ".join(table.header), allowed, where)
    if not table.rows:
        raise SpecError(KEY, str(path), "a table with a header and a row at least")
    wrong = fault(list(zip(*(found[c] for c in COLUMNS), strict=True)))
    if wrong:
        place, value, allowed = wrong
        raise SpecError(KEY, value, allowed, f"{path}, line {table.rows[place][0]}")
    return {c: found[c] for c in COLUMNS}
