"""Points of a yield locus out of what shear testers write: a plain table, or the export of
RheoCompass (Anton Paar).

The table has a row for each point: the normal stress, and the shear stress at its peak, in steady
state, or both. The export is laid out as public readers of it tell (github.com/bsaintmichel/
read-rheol; the R package of J. L. Gentry; both read other tests than shear cells). Each interval
has a line `Interval data:` with the names of its columns, a line of their units in brackets, and a
line for each reading. It does not say which of its intervals are points of a yield locus and which
are pre-shear: that is asked for.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from statistics import fmean

import pandas as pd
from scipy import stats

from calibration.errors import CalibrationError, ConfigError
from calibration.files import write_table
from calibration.intake.measurements import readings_table
from calibration.intake.tables import read_rows, read_table
from dem.units import UnitError, has_unit, in_unit, unit_of, without_unit

LOAD, PEAK, STEADY = "normal_stress", "shear_stress", "steady_shear_stress"
INTERVAL = "interval data:"
RESULT = "result:"
STEADY_SHARE = 5
"""A steady state is the mean of the last one in so many readings of an interval."""


@dataclass(frozen=True)
class Point:
    """A shear stress [kPa] under a normal stress [kPa]; quantity: PEAK or STEADY; note: where it
    comes from."""

    quantity: str
    load: float
    shear: float
    note: str


@dataclass(frozen=True)
class Interval:
    """Readings of one interval of an export: loads and shears (n,) [kPa]; result: the name of the
    part that it stands in."""

    result: str
    loads: list
    shears: list

    def points(self, note: str) -> Iterator[Point]:
        """Its peak, with the load at that reading, and the mean of its last readings."""
        at, last = self.shears.index(max(self.shears)), -(-len(self.shears) // STEADY_SHARE)
        yield Point(PEAK, self.loads[at], self.shears[at], note)
        yield Point(STEADY, fmean(self.loads[-last:]), fmean(self.shears[-last:]), note)


def measure_shear(
    paths: Sequence[Path],
    chosen: Sequence[int] = (),
    out: Path | None = None,
    sheet: str | None = None,
) -> list[str]:
    """Lines to print: each file's points and their yield locus. Writes the table `out` of shear
    stresses. Raises CalibrationError.

    chosen: numbers of the intervals that are points, for exports; sheet: of workbooks."""
    if out is not None and out.exists():
        raise CalibrationError(f"{out}: exists already")
    found = {path: read_points(path, chosen, sheet) for path in paths}
    lines = [line for path, points in found.items() for line in _said(path, points)]
    if out is not None:
        write_table(_table([p for points in found.values() for p in points]), out)
        lines.append(f"wrote {out}: rows for the study's table of measured values")
    return lines


def read_points(path: Path, chosen: Sequence[int] = (), sheet: str | None = None) -> list[Point]:
    """[Point] of a file. Raises ConfigError for a table without these columns or their units, and
    for an export of which it is not said which intervals are points."""
    intervals = _intervals(path, sheet)
    if intervals:
        return _of_intervals(path, intervals, chosen)
    if chosen:
        raise ConfigError("has no intervals", path=path, allowed="--intervals for exports alone")
    return _of_table(path, sheet)


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
    parts = []
    for quantity in (PEAK, STEADY):
        own = [p for p in points if p.quantity == quantity]
        values, notes = [round(p.shear, 6) for p in own], [p.note for p in own]
        part = readings_table("shear", quantity, values, "kPa", notes)
        parts.append(part.assign(normal_stress_kPa=[round(p.load, 6) for p in own]))
    return pd.concat([p for p in parts if len(p)], ignore_index=True)


def _of_table(path, sheet):
    """[Point] of a plain table, whatever unit of stress its columns are in."""
    table = read_table(path, sheet=sheet)
    columns = {_plain(name): name for name in table.header}
    if LOAD not in columns or not {PEAK, STEADY} & set(columns):
        allowed = f"{LOAD} and {PEAK} (the peak), {STEADY} or both, with units"
        raise ConfigError("has no columns of a yield locus", path=path, line=table.header_line,
                          value=", ".join(table.header), allowed=allowed)  # fmt: skip
    points = []
    for line, row in table.rows:
        load = _stress(table, line, columns[LOAD], row)
        for quantity in (PEAK, STEADY):
            if quantity in columns and row[columns[quantity]]:
                shear = _stress(table, line, columns[quantity], row)
                points.append(Point(quantity, load, shear, f"{path.name}, line {line}"))
    if not points:
        raise ConfigError("has no shear stress", path=path, allowed="a row for each point")
    return points


def _plain(name):
    """`normal_stress` of `Normal stress` and of `normal_stress_Pa`."""
    return without_unit("_".join(name.split())).lower()


def _stress(table, line, column, row):
    """Stress [kPa] of a cell. Raises ConfigError where neither cell nor heading has a unit."""
    own = table.units.get(column) or unit_of(column)
    if not own and not has_unit(row[column].replace(",", ".")):
        raise ConfigError("has no unit", path=table.path, line=line, column=column,
                          value=row[column],
                          allowed=f"{column} [kPa], or another unit of stress")  # fmt: skip

    def in_kpa(text):
        return in_unit(text if has_unit(text) else f"{text} {own}", "kPa")

    found = table.number(line, column, row[column], in_kpa)
    if found < 0:
        raise ConfigError("is below zero", path=table.path, line=line, column=column,
                          value=row[column], allowed="the size of a stress")  # fmt: skip
    return found


def _intervals(path, sheet):
    """[Interval] of an export; none for a table of another kind."""
    rows, found, result = read_rows(path, INTERVAL, sheet=sheet), [], ""
    for k, (line, cells) in enumerate(rows):
        if cells[0].lower() == RESULT:
            result = " ".join(cells[1:]).strip()
        elif cells[0].lower() == INTERVAL:
            below = takewhile(lambda row: not row[1][0], rows[k + 1 :])
            body = [row for row in below if any(row[1])]
            found.append(_interval(path, line, cells, body, result))
    return found


def _interval(path, line, header, body, result):
    """`Interval` of its heading and the rows below: units in brackets, then readings."""
    names = [_plain(cell) for cell in header]
    for name in (LOAD, PEAK):
        if name not in names:
            reason = f"has no column {name.replace('_', ' ').title()}"
            raise ConfigError(reason, path=path, line=line, value=", ".join(filter(None, header)),
                              allowed="an export with it (the table's columns)")  # fmt: skip
    at = [names.index(name) for name in (LOAD, PEAK)]
    if len(body) < 2:
        raise ConfigError("has no readings below it", path=path, line=line)
    units = [_cell(body[0][1], c).strip("[]") for c in at]
    pairs = [
        [_reading(path, n, header[c], _cell(cells, c), unit)
         for c, unit in zip(at, units, strict=True)]
        for n, cells in body[1:]
    ]  # fmt: skip
    loads, shears = zip(*pairs, strict=True)
    return Interval(result, list(loads), list(shears))


def _cell(cells, column):
    return cells[column] if column < len(cells) else ""


def _reading(path, line, column, text, unit):
    try:
        return in_unit(f"{text} {unit}", "kPa")
    except UnitError as error:
        where = {"path": path, "line": line, "column": column}
        raise ConfigError(str(error), **where, value=f"{text} {unit}") from None


def _of_intervals(path, intervals, chosen):
    """[Point] of the chosen intervals. Raises ConfigError that tells what there is where none or
    others are chosen."""
    numbered = dict(enumerate(intervals, 1))
    strange = [n for n in chosen if n not in numbered]
    if strange or not chosen:
        told = "; ".join(
            f"{n} {x.result}: peak {max(x.shears):.4g} kPa under {fmean(x.loads):.4g} kPa"
            for n, x in numbered.items()
        )
        reason = f"has no interval {strange[0]}" if strange else f"has {len(intervals)} intervals"
        allowed = "--intervals with the numbers of those that are points of the yield locus"
        raise ConfigError(f"{reason} ({told})", path=path, allowed=allowed)
    return [point for n in chosen for point in numbered[n].points(f"{path.name}, interval {n}")]
