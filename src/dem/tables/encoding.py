"""From the bytes of a file to texts: what kind of file it is, how its letters are written, and the
rows of a workbook's sheet, of the one that holds anything or that was named."""

import codecs
import datetime
import io
import math
import re
import warnings
import zipfile
from pathlib import Path

from dem.errors import refused
from dem.tables.limits import LONGEST_CELL, MB, MOST_UNPACKED, check_cells

_OTHERS = (
    (b"\xd0\xcf\x11\xe0", "is an old or encrypted Office file (.xls)"),
    (b"%PDF", "is a PDF"),
    (b"\x89PNG", "is a picture"),
    (b"\xff\xd8\xff", "is a picture"),
    (b"\x1f\x8b", "is compressed (gzip)"),
    (b"{\\rtf", "is a text document (RTF)"),
)
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def is_workbook(data: bytes, path: Path) -> bool:
    """Return whether a file is a workbook and not a text, by content. Raises InputError where the
    name says otherwise, or for a file of another kind."""
    found = next((what for start, what in _OTHERS if data.startswith(start)), None)
    if found:
        raise refused("other kind", path=path, what=found)
    named = path.suffix.lower() in (".xlsx", ".xlsm")
    if not data.startswith(b"PK\x03\x04"):
        if named:
            raise refused("no workbook", path=path)
        return False
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            holds = "xl/workbook.xml" in packed.namelist()
            size = sum(part.file_size for part in packed.infolist())
    except Exception:  # its directory may be damaged in a dozen ways
        holds = False
    # the library reads no more of a part than it says to hold
    if holds and size > MOST_UNPACKED:
        most = MOST_UNPACKED / MB
        raise refused("unpacks", path=path, value=f"{size / MB:.3g} MB", most=most)
    if not holds:
        what = "is a compressed file and no workbook (OpenDocument, or a zip archive)"
        raise refused("other kind", path=path, what=what)
    if not named:
        name = {"named": path.suffix or "text", "stem": path.stem}
        raise refused("workbook by another name", path=path, **name)
    return True


def decode(data: bytes, path: str | Path) -> tuple[str, str]:
    """(text, encoding) of a text file: by its byte order mark, else UTF-8, else Windows' cp1252.

    Raises InputError where it is none of these.
    """
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), None)
    encoding = encoding or _unmarked(data)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = None
    if text is None or re.search(r"[\x00-\x08\x0e-\x1f\x7f\ufffd]", text):
        raise refused("not text", path=path)
    # a cell that is longer than any note is that of a file of another kind
    for number, line in enumerate(split_lines(text), 1):
        longest = max(re.split("[\t;,]", line), key=len) if len(line) > LONGEST_CELL else ""
        if len(longest) > LONGEST_CELL:
            begins = f"{longest[:40]}... ({len(longest):,} characters)"
            raise refused("long cell", path=path, line=number, value=begins, most=LONGEST_CELL)
    return text, encoding.removesuffix("-sig")


def _unmarked(data):
    """UTF-16 shows by the zeros beside each letter; UTF-8 by its own rules, which other text
    breaks."""
    pairs = len(data) // 2
    if pairs and data[1::2].count(0) > 0.6 * pairs:
        return "utf-16-le"
    if pairs and data[0::2].count(0) > 0.6 * pairs:
        return "utf-16-be"
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def split_lines(text: str) -> list[str]:
    """Lines as every editor counts them: ended by LF, CR LF or CR alone."""
    return re.split(r"\r\n|\r|\n", text)


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
        raise refused("empty workbook", path=path)
    names = ", ".join(filled)
    if sheet is not None and sheet not in filled:
        raise refused("no such sheet", path=path, value=sheet, names=names)
    if sheet is None and len(filled) > 1:
        raise refused("several sheets", path=path, value=names)
    name = sheet or next(iter(filled))
    cells = filled[name]
    for (row, column), cell in sorted(formulas[name]._cells.items()):
        if cell.data_type == "f" and (row, column) not in cells:
            where = {"line": row, "column": cell.column_letter}
            raise refused("formula", path=path, value=str(cell.value), **where)
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
        raise refused("damaged workbook", path=path, said=said) from None


def _filled(sheet):
    """{(row, column): value} of the cells that hold anything. Cells of a format alone do not count:
    they may reach to the last row that a spreadsheet has. The library's own way to the rows would
    make every cell up to the last one."""
    return {place: c.value for place, c in sheet._cells.items() if c.value not in (None, "")}


def _merged(sheet, cells, path):
    """{(row, column): text} of the cells that words stand for which are merged downwards. Raises
    InputError for a number that is merged: one reading or several cannot be told."""
    found = {}
    for area in sheet.merged_cells.ranges:
        value = cells.get((area.min_row, area.min_col))
        if value is None or area.min_row == area.max_row:
            continue
        if isinstance(value, int | float):
            place = {"line": area.min_row, "last": area.max_row}
            raise refused("merged", path=path, value=_text(value), **place)
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
