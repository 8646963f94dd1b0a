"""A table as it was read: its headings, its cells as texts with their lines, and how it was
recognised."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from dem.errors import InputError, refused
from dem.io.files import rows_of
from dem.tables import dialect as dialects
from dem.tables.encoding import decode, is_workbook, split_lines, workbook_rows
from dem.tables.limits import LONGEST_CELL, check_cells, read_limited

_DATE = re.compile(
    r"\d{4}-\d\d-\d\d|\d{1,2}\.\s?[^\W\d]{3,9}\.?|\d{1,2}-[A-Za-z]{3}|[A-Za-z]{3}-\d\d"
)
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")

UNITS = {
    row["written"]: row["unit"] for row in rows_of(Path(__file__).with_name("written_units.csv"))
}
"""What counts as a unit without brackets about it, and that unit. `Grad` with a capital is the
German degree, `grad` may be a gon."""
_BEHIND = re.compile(r"(.*\S)(?:\s+in\s+|\s+en\s+|\s*,\s+|\s+/\s+)(\S{1,12})")
_BEGINS_AS_NUMBER = re.compile(r"[+-]?[.,]?\d")


@dataclass(frozen=True)
class Table:
    """header: the columns' names without their units; rows: [(line, {column: text})]; decimal: `.`
    or `,`."""

    path: Path
    header: tuple
    header_line: int
    rows: tuple
    decimal: str
    how: str
    units: dict

    def texts(self, column: str) -> list[tuple[int, str]]:
        """[(line, text)] of a column. Raises InputError where there is none of this name."""
        self.require(column)
        return [(line, row[column]) for line, row in self.rows]

    def require(self, *columns: str) -> None:
        """Raise InputError for the first of the columns that is missing, with the nearest name
        that is there."""
        missing = next((column for column in columns if column not in self.header), None)
        if missing is not None:
            near = difflib.get_close_matches(missing, self.header, n=1, cutoff=0.6)
            near = f"; did you mean {near[0]}?" if near else ""
            place = {"path": self.path, "line": self.header_line, "column": missing}
            raise refused("no column", **place, near=near, names=", ".join(self.header))

    def fault(self, line: int, column: str, reason: str, **more: Any) -> InputError:
        """The error of a cell; more: its `value`, and what is `allowed`."""
        return InputError(reason, path=self.path, line=line, column=column, **more)

    def number(
        self,
        line: int,
        column: str,
        text: str,
        convert: Callable[[str], float] | None = None,
        finite: bool = True,
    ) -> float:
        """Number of a cell, a finite one unless said otherwise.

        convert: takes a text with a decimal point, where cells may carry a unit.

        Raises InputError naming line, column and value.
        """
        where = {"path": self.path, "line": line, "column": column, "value": text or None}  # type: dict
        if not text:
            raise refused("empty cell", **where)
        if _DATE.fullmatch(text):
            raise refused("date", **where)
        point = dialects.plain(text, self.decimal)
        try:
            value = convert(point) if convert else float(point)
        except ValueError as error:
            why = str(error) if convert else "is not a number"
            raise refused("no number", **where, why=why) from None
        if finite and not math.isfinite(value):
            raise refused("not finite", **where)
        return value

    def numbers(self, column: str, convert: Callable[[str], float] | None = None) -> list[float]:
        """[number] of a column. Raises InputError as `number` does."""
        return [self.number(line, column, text, convert) for line, text in self.texts(column)]


def parted(cell: str) -> tuple[str, str]:
    """(name, unit) of a heading; the unit is empty where none stands behind the name."""
    cell = cell.strip()
    opening = max(cell.rfind("["), cell.rfind("("))
    if cell.endswith(("]", ")")) and opening >= 0:
        unit = cell[opening + 1 : -1].strip()
        return (cell[:opening].strip() or cell), UNITS.get(unit, unit)
    match = _BEHIND.fullmatch(cell) if len(cell) <= 200 else None
    if match and match[2] in UNITS:
        return match[1], UNITS[match[2]]
    return cell, ""


def words_alone(cells: Iterable[str]) -> bool:
    """Return whether no cell is a number or begins as one does."""
    return not any(_BEGINS_AS_NUMBER.match(c) for c in cells)


def read_table(
    path: str | Path, check: Callable[..., object] | None = None, sheet: str | None = None
) -> Table:
    """`Table` of a CSV or tab-separated text or a workbook.

    A line that begins with `#` is a comment. Blank lines do not count, nor does a title line above
    the headings. Line numbers are those of the file. check: called with the headings and their line
    before any row is read; sheet: the one that is meant of a workbook with several. Raises
    InputError naming file, line and what is allowed.
    """
    path = Path(path)
    data = read_limited(path, "table")
    if not data.strip(b"\0 \t\r\n"):
        raise refused("empty table", path=path)
    if is_workbook(data, path):
        rows = workbook_rows(data, path, sheet)
        rows = [(n, r) for n, r in rows if any(r) and not r[0].startswith("#")]
        how = "workbook" if sheet is None else f"workbook, sheet {sheet}"
        return _table(path, rows, None, how, check)
    if sheet is not None:
        raise refused("no sheets", path=path, value=sheet)
    text, encoding = decode(data, path)
    return table_of(text, path, "" if encoding == "utf-8" else encoding, check)


def table_of(
    text: str,
    path: str | Path = "the table",
    encoding: str = "",
    check: Callable[..., object] | None = None,
) -> Table:
    """`Table` of a text, as one that was pasted. Raises InputError as `read_table` does."""
    declared, lines = _lines(text)
    if not lines:
        raise refused("empty table", path=path)
    separator = _below_title(lines, path) if declared is None else None
    if separator is None:
        separator = dialects.separator_of(lines, path, declared)
    rows = [(n, dialects.cells_of(x, separator, path, n)) for n, x in lines]
    how = ", ".join(w for w in (dialects.NAMES.get(separator, separator), encoding) if w)
    return _table(path, [(n, r) for n, r in rows if any(r)], separator, how, check)


def _below_title(lines, path):
    """Separator of the lines below the first one, where that may be a title; else None. Whether it
    is one, the cells tell."""
    if len(lines) < 3:
        return None
    try:
        separator = dialects.separator_of(lines[1:], path)
        first, second = (
            [c for c in dialects.cells_of(text, separator, path, n) if c] for n, text in lines[:2]
        )
    except InputError:
        return None
    return separator if _is_title(first, second) else None


def _is_title(first, second):
    """Return whether a row of one text stands above headings: two words or more, and no number."""
    return len(first) == 1 and len(second) > 1 and words_alone(first) and words_alone(second)


def _lines(text):
    """(separator that the first line declares as a spreadsheet does, [(line, text)] that count)."""
    declared, kept = None, []
    for number, line in enumerate(split_lines(text), 1):
        bare = line.strip().strip('"')
        if number == 1 and re.fullmatch(r"sep=.", bare, re.I):
            declared = bare[4]
        elif bare and not bare.startswith("#"):
            kept.append((number, line))
    return declared, kept


def _table(path, rows, separator, how, check):
    if not rows:
        raise refused("empty table", path=path)
    check_cells(path, len(rows), max(len(r) for _, r in rows))
    rows, title = _untitled(rows)
    how += f", line {title} is a title" if title else ""
    line, cells = rows[0]
    header, units = _header(cells, path, line)
    if check:
        check([h for h in header if h], line)
    body = [(n, _fitted(r, header, separator, path, n)) for n, r in rows[1:]]
    decimal = "." if separator is None else dialects.decimal_of(body, separator, path)
    kept = tuple((n, {h: c for h, c in zip(header, r, strict=True) if h}) for n, r in body)
    how += ", decimal commas" if decimal == "," else ""
    return Table(path, tuple(h for h in header if h), line, kept, decimal, how, units)


def _untitled(rows):
    """(rows from the headings on, line of a title that stood above them or None)."""
    filled = [[c for c in cells if c] for _, cells in rows[:3]]
    titled = len(filled) > 2 and _is_title(*filled[:2])
    if len(filled) > 2 and all(len(f) == 1 for f in filled) and words_alone(filled[0]):
        # of a single column: what stands below the title is a heading with a unit
        titled = bool(parted(filled[1][0])[1]) and not parted(filled[0][0])[1]
    return (rows[1:], rows[0][0]) if titled else (rows, None)


def _header(cells, path, line):
    """(names, {name: unit that stands behind it}). Raises InputError for a number among them."""
    names, units = [], {}
    for cell in cells:
        if len(cell) > LONGEST_CELL or _NUMBER.fullmatch(cell.replace(",", ".")):
            raise refused("number as heading", path=path, line=line, value=cell[:60])
        name, unit = parted(cell)
        if unit == "grad":
            raise refused("grad", path=path, line=line, column=name, value=unit)
        if name and name in names:
            raise refused("twice", path=path, line=line, column=name)
        if unit and name != cell:
            units[name] = unit
        names.append(name)
    return names, units


def _fitted(cells, header, separator, path, line):
    """Cells of a row, as many as the header has. Raises InputError for cells without heading."""
    value = (separator or ",").join(cells)[:80]
    if len(cells) > len(header):
        asked = ""
        if separator == "," and cells[-1]:
            # the last two neighbours that a decimal comma may have parted, else the last two
            pairs = list(pairwise(cells))[::-1]
            whole = (p for p in pairs if re.fullmatch(r"[+-]?\d+", p[0]) and p[1].isdecimal())
            left, right = next(whole, pairs[0])
            asked = f": is {left},{right} one number with a decimal comma, or {left} and {right}?"
        counts = {"cells": len(cells), "columns": len(header), "asked": asked}
        raise refused("wide row", path=path, line=line, value=value, **counts)
    if any(c and not h for c, h in zip(cells, header, strict=False)):
        raise refused("no heading", path=path, line=line, value=value)
    return cells + [""] * (len(header) - len(cells))
