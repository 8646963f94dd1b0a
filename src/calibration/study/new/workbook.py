"""The methods' questions as a workbook with a sheet a test, and a filled one as answers.

A sheet has a line of headings, below it the questions in words, what is allowed and an example, and
then a row for each reading. A cell of a condition that is empty stands for that of the row above.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError, ConfigError
from calibration.files import replacing
from calibration.intake.guard import decoding, in_study
from calibration.intake.tables import read_rows
from calibration.study.new.answers import Faults, Raw, entries_of, read_entries, with_unit
from calibration.study.new.methods import Method, methods
from dem.tables.encoding import WORKBOOK, kind_of, read_bytes
from dem.tables.limits import MOST_CELLS, MOST_COLUMNS
from dem.units import in_ascii, unit_of

FIRST, NOTES = "read me", "notes"
"""Sheets of words, which are not read."""

HEADINGS, ASKED, ALLOWED, EXAMPLE = "question", "asked for", "allowed", "example"
LABELS = (ASKED, ALLOWED, EXAMPLE)
ROWS = 200  # that have drop-downs
WIDTHS = {"label": 12, "other": 26}
HEADING = re.compile(r"\s*([^\[\]]+?)\s*(?:\[(.*)\])?\s*")
WORDS = (
    "Fill in the sheets of the tests that you made, and leave the others empty.",
    "Write your values below the line `example`, a row for each reading.",
    "A cell without a unit has that of its heading; one with its own (78 mm) is taken at its word.",
    "What stays the same from row to row (a height, a diameter) may be written once.",
    "Of a mean write its standard deviation (sd) and of how many readings it is (n) beside it.",
    "The sheet grain is needed, and one of: its diameter, the sheet axes, the sheet sieve.",
    "Then: dem new FOLDER --from THIS_FILE",
    "The sheets `read me` and `notes` are not read.",
)


def write_workbook(path: Path) -> str:
    """Write an empty workbook; returns a sentence. Raises CalibrationError for a file that exists
    or is called otherwise."""
    import openpyxl  # takes a quarter of a second

    if path.suffix.lower() != ".xlsx":
        raise CalibrationError(f"{path}: is no name of a workbook; allowed: one that ends in .xlsx")
    if path.exists():
        raise CalibrationError(f"{path}: exists already; allowed: another name")
    book = openpyxl.Workbook()
    first = book.active
    first.title = FIRST
    for row, text in enumerate(WORDS, 1):
        first.cell(row, 1, text)
    first.column_dimensions["A"].width = 100
    for method in methods().values():
        _fill(book.create_sheet(method.name), method)
    book.create_sheet(NOTES)
    with replacing(path) as partial:
        book.save(partial)
    return (
        f"wrote {path}, a sheet a test. Fill in those you made, then: dem new FOLDER --from {path}"
    )


def _unit(q):
    return in_ascii(unit_of(q.unit)) if q.unit else ""


def _head(method):
    """The lines that a sheet begins with: the title, then a label and a text a question."""
    columns = method.columns
    return [
        [f"{method.title}. {method.about}"],
        [HEADINGS, *(q.key + (f" [{_unit(q)}]" if _unit(q) else "") for q in columns)],
        [ASKED, *(q.text + (" (needed)" if q.needed else "") for q in columns)],
        [ALLOWED, *(q.allowed for q in columns)],
        [EXAMPLE, *(q.example for q in columns)],
    ]


def _fill(sheet, method):
    from openpyxl.styles import Alignment, Font, PatternFill
    from openpyxl.worksheet.datavalidation import DataValidation

    columns, (title, *rows) = method.columns, _head(method)
    sheet.cell(1, 1, title[0]).font = Font(bold=True)
    for row, (label, *texts) in enumerate(rows, 2):
        for column, text in enumerate((label, *texts), 1):
            cell = sheet.cell(row, column, text)
            cell.alignment = Alignment(wrap_text=True, vertical="top")
            cell.fill = PatternFill("solid", fgColor="FFF2F4F6")
            cell.font = Font(bold=label == HEADINGS, italic=label == EXAMPLE)
            letter = cell.column_letter
            sheet.column_dimensions[letter].width = WIDTHS["label" if column == 1 else "other"]
            if label == HEADINGS and column > 1 and columns[column - 2].words:
                words = ",".join(columns[column - 2].words)
                choice = DataValidation("list", formula1=f'"{words}"', allow_blank=True)
                choice.add(f"{letter}{len(rows) + 2}:{letter}{ROWS}")
                sheet.add_data_validation(choice)
    sheet.freeze_panes = sheet.cell(len(rows) + 2, 2)


def read_workbook(path: Path) -> list[Raw]:
    """[Raw] of all tests that a filled workbook holds. Raises `Faults` that name sheet and cell,
    and CalibrationError for a file that is no workbook."""
    names, faults, found = _names(path), [], []
    for name in names:
        if name.strip().lower() in (FIRST, NOTES):
            continue
        try:
            rows = read_rows(path, sheet=name)
        except ConfigError as error:
            faults.append(f"{path.name}, sheet {name}: {_reason(error)}")
            continue
        method = methods().get(name.strip().lower())
        if method is None:
            known = ", ".join((*methods(), FIRST, NOTES))
            faults.append(f"{path.name}, sheet {name}: is no test; allowed: {known}")
        else:
            found += _of_sheet(f"{path.name}, sheet {name}", method, rows, faults)
    if faults:
        raise Faults([*faults, *_further(found)])
    if not found:
        raise CalibrationError(
            f"{path}: holds no values; allowed: rows below the line `example` of a test's sheet"
        )
    return found


def _further(found):
    """Faults of the answers that could be taken out of the sheets."""
    try:
        read_entries(found)
    except Faults as more:
        return more.faults
    return []


def _reason(error):
    """What is wrong in a sheet, with its line where it has one."""
    text = str(error)
    return text.split(": ", 1)[1] if error.line is None and ": " in text else (
        f"{f'column {error.column}, ' if error.column else ''}line {error.line}: {error.reason}"
        f"{f'; allowed: {error.allowed}' if error.allowed else ''}"
    )  # fmt: skip


def _names(path):
    """Names of a workbook's sheets that hold more than they were written with."""
    with in_study():
        data = read_bytes(path)
        kind = kind_of(data, path)
    if kind != WORKBOOK:
        raise CalibrationError(
            f"{path}: is no workbook; allowed: one that `dem new FOLDER --workbook FILE.xlsx` wrote"
        )
    import openpyxl

    with decoding(path, "a workbook without password"):
        book = openpyxl.load_workbook(path, read_only=True)
        try:
            return [sheet.title for sheet in book.worksheets if _changed(sheet)]
        finally:
            book.close()


def _changed(sheet):
    """Whether a sheet holds anything, and not its own lines alone; so does one that is larger than
    any table, which is refused by who reads it."""
    method = methods().get(sheet.title)
    own = [[c for c in line if c] for line in _head(method)] if method else []
    rows, seen = [], 0
    for line in sheet.iter_rows(values_only=True):
        seen += max(len(line), 1)
        if len(line) > MOST_COLUMNS or seen > MOST_CELLS:
            return True
        if row := [c for c in line if c is not None and str(c).strip()]:
            rows.append(row)
    return bool(rows) and rows != own


def _of_sheet(place, method, rows, faults):
    """[Raw] of a method's sheet."""
    at = next((k for k, (_, cells) in enumerate(rows) if _plain(cells[0]) == HEADINGS), None)
    if at is None:
        faults.append(
            f"{place}: has no line of headings; allowed: the sheet as it was written, whose column "
            f"A says {HEADINGS}"
        )
        return []
    headings = [HEADING.fullmatch(cell) for cell in rows[at][1]]
    body, example = [], [q.example for q in method.columns]
    for line, cells in rows[at + 1 :]:
        label = _plain(cells[0])
        if label not in LABELS:
            body.append((line, cells))
        elif label == EXAMPLE and [c for c in cells[1:] if c] != [c for c in example if c]:
            faults.append(f"{place}, line {line}: the example was written over; allowed: your "
                          "values below it, and the example left as it was")  # fmt: skip
    rows_of = ((n, dict(_answers(place, method, n, headings, cells, faults))) for n, cells in body)
    filled = [(line, found) for line, found in rows_of if found]
    if not filled:
        return []
    return entries_of(place, method, filled, faults)


def _plain(cell):
    return cell.strip().lower()


def _answers(
    place: str, method: Method, line: int, headings: list, cells: list[str], faults: list[str]
) -> Iterator[tuple[str, Any]]:
    """(question's key, (text, place)) of the filled cells of a row."""
    from openpyxl.utils import get_column_letter

    for column, text in enumerate(cells[1:], 2):
        if not text:
            continue
        where = f"{place}, cell {get_column_letter(column)}{line}"
        heading = headings[column - 1] if column <= len(headings) else None
        if heading is None or not heading[1]:
            faults.append(f"{where}: {text} stands below no heading; allowed: the sheet's columns")
            continue
        key = heading[1].strip()
        yield key, (with_unit(method.question(key), text, heading[2]), where)
