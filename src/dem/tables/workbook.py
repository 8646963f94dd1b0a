"""Rows of a workbook's sheet, as texts: of the one that holds anything, or of the one that was
named."""

import datetime
import io
import math
import warnings
import zipfile
from pathlib import Path

from dem.errors import InputError
from dem.tables.limits import check_cells

DATE = "is a date: a spreadsheet turned a number such as 26.1 into one"


def workbook_rows(
    data: bytes, path: str | Path, sheet: str | None = None
) -> list[tuple[int, list[str]]]:
    """[(row number, [text])] of the one sheet that holds anything, or of the one of that name.

    Raises InputError for none, for several of which none is named, for more cells than a
    table has, or a file that cannot be read.
    """
    values, formulas = _books(data, path)
    filled = {s.title: found for s in values.worksheets if (found := _filled(s))}
    if not filled:
        raise InputError("is empty", path=path, allowed="a sheet with headings and values")
    names = ", ".join(filled)
    if sheet is not None and sheet not in filled:
        raise InputError("has no such sheet with cells", path=path, value=sheet, allowed=names)
    if sheet is None and len(filled) > 1:
        allowed = "one sheet with cells, or the sheet named by --sheet where a command takes it"
        raise InputError("has several sheets", path=path, value=names, allowed=allowed)
    name = sheet or next(iter(filled))
    cells = filled[name]
    _check_formulas(formulas[name], cells, path)
    rows, columns = (max(place) for place in zip(*cells, strict=True))
    check_cells(path, rows, columns, rows)
    texts = {place: _text(value) for place, value in cells.items()}
    texts |= _merged(values[name], cells, path)
    across = range(1, columns + 1)
    return [(row, [texts.get((row, k), "") for k in across]) for row in range(1, rows + 1)]


def _books(data, path):
    """The workbook with the results of its formulas, and with the formulas; one and the same where
    there are none."""
    import openpyxl  # takes a quarter of a second, which a text table need not wait for

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles and extensions, which no cell needs
            values = openpyxl.load_workbook(io.BytesIO(data), data_only=True)
            with zipfile.ZipFile(io.BytesIO(data)) as packed:
                sheets = [n for n in packed.namelist() if n.startswith("xl/worksheets/")]
                formulas = any(b"<f" in packed.read(name) for name in sheets)
            return values, openpyxl.load_workbook(io.BytesIO(data)) if formulas else values
    # a damaged part comes out of the library, or of those that unpack and parse for it, as an
    # error of a dozen kinds
    except Exception as error:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        reason = f"cannot be read as a workbook ({said:.200})"
        raise InputError(reason, path=path, allowed="a workbook without password, or CSV") from None


def _filled(sheet):
    """{(row, column): value} of the cells that hold anything. Cells of a format alone do not count:
    they may reach to the last row that a spreadsheet has. The library's own way to the rows would
    make every cell up to the last one."""
    return {place: c.value for place, c in sheet._cells.items() if c.value not in (None, "")}


def _check_formulas(sheet, cells, path):
    for (row, column), cell in sorted(sheet._cells.items()):
        if cell.data_type == "f" and (row, column) not in cells:
            raise InputError(
                "is a formula without its result", path=path, line=row, column=cell.column_letter,
                value=str(cell.value), allowed="the workbook opened and saved once, or values",
            )  # fmt: skip


def _merged(sheet, cells, path):
    """{(row, column): text} of the cells that words stand for which are merged downwards. Raises
    InputError for a number that is merged: one reading or several cannot be told."""
    found = {}
    for area in sheet.merged_cells.ranges:
        value = cells.get((area.min_row, area.min_col))
        if value is None or area.min_row == area.max_row:
            continue
        if isinstance(value, int | float):
            raise InputError(
                f"is merged down to line {area.max_row}: one reading or several?", path=path,
                line=area.min_row, value=_text(value), allowed="a cell for each reading",
            )  # fmt: skip
        last = max(row for row, _ in cells)
        rows = range(area.min_row + 1, min(area.max_row, last) + 1)
        found |= {(row, area.min_col): _text(value) for row in rows}
    return found


def _text(value):
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()[:10] if isinstance(value, datetime.date) else str(value)
    if isinstance(value, float) and math.isfinite(value):
        return f"{value:.15g}"  # as the sheet shows it: 27.4, not 27.399999999999999
    return str(value).strip()
