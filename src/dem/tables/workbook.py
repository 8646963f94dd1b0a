"""Rows of a workbook's only sheet that holds anything, as texts."""

import datetime
import io
import zipfile

from dem.errors import InputError

DATE = "is a date: a spreadsheet turned a number such as 26.1 into one"


def workbook_rows(data, path):
    """[(row number, [text])] of the one sheet that holds anything.

    Raises InputError for none, several, or a file that cannot be read.
    """
    import openpyxl  # takes a quarter of a second, which a text table need not wait for

    try:
        values, formulas = (
            openpyxl.load_workbook(io.BytesIO(data), data_only=only) for only in (True, False)
        )
    except (ValueError, KeyError, OSError, SyntaxError, zipfile.BadZipFile) as error:
        reason = f"cannot be read as a workbook ({str(error).splitlines()[0]})"
        raise InputError(reason, path=path, allowed="a workbook without password, or CSV") from None
    filled = [s for s in values.worksheets if any(any(c is not None for c in r) for r in s.values)]
    if not filled:
        raise InputError("is empty", path=path, allowed="a sheet with headings and values")
    if len(filled) > 1:
        names = ", ".join(s.title for s in filled)
        raise InputError(
            "has several sheets", path=path, value=names, allowed="one sheet with cells"
        )
    return _rows(filled[0], formulas[filled[0].title], path)


def _rows(sheet, formulas, path):
    rows = []
    for number, row in enumerate(sheet.iter_rows(values_only=True), 1):
        cells = []
        for column, value in enumerate(row, 1):
            if value is None and formulas.cell(number, column).value is not None:
                raise InputError(
                    "is a formula without its result",
                    path=path,
                    line=number,
                    value=str(formulas.cell(number, column).value),
                    allowed="the workbook opened and saved once, or values",
                )
            cells.append(_text(value))
        rows.append((number, cells))
    return rows


def _text(value):
    if value is None:
        return ""
    if isinstance(value, datetime.date | datetime.time):
        return f"{value:%Y-%m-%d}" if isinstance(value, datetime.date) else str(value)
    if isinstance(value, float):
        return f"{value:.15g}"  # as the sheet shows it: 27.4, not 27.399999999999999
    return str(value).strip()
