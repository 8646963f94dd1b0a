"""The spheres of a grain from a table: a CSV file with the columns `x_mm`, `y_mm`, `z_mm` and
`radius_mm`, one sphere a row."""

from dem.clump import fault
from dem.errors import SpecError
from dem.io.table import read_number, read_rows

KEY = "particles.clump.file"
COLUMNS = ("x_mm", "y_mm", "z_mm", "radius_mm")


def read_clump(path):
    """{column: values (m,) [mm]} of a table. Raises SpecError naming line, value and what is
    allowed."""
    header, rows = read_rows(KEY, path)
    if sorted(header) != sorted(COLUMNS):
        allowed = f"the columns {', '.join(COLUMNS)}, one sphere a row"
        raise SpecError(KEY, ", ".join(header), allowed, f"{path}, line 1")
    spheres = [tuple(read_number(KEY, path, n, r, header, c) for c in COLUMNS) for n, r in rows]
    wrong = fault(spheres)
    if wrong:
        place, value, allowed = wrong
        raise SpecError(KEY, value, allowed, f"{path}, line {rows[place][0]}")
    return {c: [s[k] for s in spheres] for k, c in enumerate(COLUMNS)}
