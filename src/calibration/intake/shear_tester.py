"""Points of a yield locus out of a table: a row for each, with the normal stress, and the shear
stress at its peak, in steady state, or both.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from scipy import stats

from calibration.files import write_table
from calibration.intake.measurements import readings_table
from calibration.intake.tables import refused
from dem.tables import read_table
from dem.units import has_unit, in_unit, unit_of, without_unit

LOAD, PEAK, STEADY = "normal_stress", "shear_stress", "steady_shear_stress"


@dataclass(frozen=True)
class Point:
    """A shear stress [kPa] under a normal stress [kPa]; quantity: PEAK or STEADY; note: where it
    comes from."""

    quantity: str
    load: float
    shear: float
    note: str


def measure_shear(
    paths: Sequence[Path], out: Path | None = None, sheet: str | None = None
) -> list[str]:
    """Lines to print: each file's points and their yield locus. Writes the table `out` of shear
    stresses. Raises CalibrationError.

    sheet: of workbooks."""
    if out is not None and out.exists():
        raise refused("exists", out)
    found = {path: read_points(path, sheet) for path in paths}
    lines = [line for path, points in found.items() for line in _said(path, points)]
    if out is not None:
        write_table(_table([p for points in found.values() for p in points]), out)
        lines.append(f"wrote {out}: rows for the study's table of measured values")
    return lines


def _said(path, points):
    for quantity in (PEAK, STEADY):
        own = [p for p in points if p.quantity == quantity]
        loads = [p.load for p in own]
        if not own:
            continue
        what = "peaks" if quantity == PEAK else "steady shear stresses"
        text = f"{path.name}: {len(own)} {what} at {min(loads):.4g} to {max(loads):.4g} kPa"
        if len(set(loads)) > 1:
            line = stats.linregress(loads, [p.shear for p in own])
            text += f", on a line of slope {line.slope:.3f} from {line.intercept:.3g} kPa"
        yield text


def _table(points):
    own = sorted(points, key=lambda p: p.quantity == STEADY)
    values, notes = [round(p.shear, 6) for p in own], [p.note for p in own]
    table = readings_table("shear", [p.quantity for p in own], values, "kPa", notes)
    return table.assign(normal_stress_kPa=[round(p.load, 6) for p in own])


def read_points(path: Path, sheet: str | None = None) -> list[Point]:
    """[Point] of a table, whatever unit of stress its columns are in. Raises ConfigError for one
    without these columns or their units."""
    table = read_table(path, sheet=sheet)
    # `normal_stress` of `Normal stress` and of `normal_stress_Pa`
    columns = {without_unit("_".join(name.split())).lower(): name for name in table.header}
    if LOAD not in columns or not {PEAK, STEADY} & set(columns):
        raise refused("no locus", path, line=table.header_line, value=", ".join(table.header))
    points = []
    for line, row in table.rows:
        load = _stress(table, line, columns[LOAD], row)
        for quantity in (PEAK, STEADY):
            if quantity in columns and row[columns[quantity]]:
                shear = _stress(table, line, columns[quantity], row)
                points.append(Point(quantity, load, shear, f"{path.name}, line {line}"))
    if not points:
        raise refused("no shear", path)
    return points


def _stress(table, line, column, row):
    """Stress [kPa] of a cell. Raises ConfigError where neither cell nor heading has a unit."""
    own = table.units.get(column) or unit_of(column)
    where = {"line": line, "column": column, "value": row[column]}
    if not own and not has_unit(row[column].replace(",", ".")):
        raise refused("no stress unit", table.path, **where)

    def in_kpa(text):
        return in_unit(text if has_unit(text) else f"{text} {own}", "kPa")

    found = table.number(line, column, row[column], in_kpa)
    if found < 0:
        raise refused("negative stress", table.path, **where)
    return found
