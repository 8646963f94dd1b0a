"""The methods' questions as one table, and a filled one as answers.

A row has a test, a question, a cell for its value, its unit, and in words what is asked. What was
read more than once stands in one cell (`26.1; 27.4`), or in copies of its row. A test that was made
under several loads, or from several heights, has its rows once for each.
"""

import csv
import io
from itertools import groupby
from pathlib import Path

from calibration.errors import CalibrationError
from calibration.files import replacing, write_text
from calibration.intake.tables import read_table
from calibration.study.new.answers import Faults, Raw, read_entries, separate, with_unit
from calibration.study.new.methods import methods
from dem.units import in_ascii, unit_of

TEST, QUESTION, VALUE, UNIT = "test", "question", "value", "unit"
COLUMNS = (TEST, QUESTION, VALUE, UNIT, "asked for", "allowed")


def write_empty(path: Path) -> str:
    """Write a table to be filled in, as CSV or as a workbook; returns a sentence. Raises
    CalibrationError for a file that exists or is called otherwise."""
    kind = path.suffix.lower()
    if kind not in (".csv", ".xlsx"):
        allowed = "one that ends in .csv or .xlsx"
        raise CalibrationError(f"{path}: is no name of a table; allowed: {allowed}")
    if path.exists():
        raise CalibrationError(f"{path}: exists already; allowed: another name")
    rows = [COLUMNS, *(_row(m, q) for m in methods().values() for q in m.columns)]
    if kind == ".csv":
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        write_text(text.getvalue(), path)
    else:
        import openpyxl  # takes a quarter of a second

        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(row)
        for column, width in zip("ABCDEF", (16, 12, 24, 10, 70, 30), strict=True):
            book.active.column_dimensions[column].width = width
        book.active.freeze_panes = "D2"
        with replacing(path) as partial:
            book.save(partial)
    return (
        f"wrote {path}, a row a question. Fill in the column {VALUE} of the tests that you made, "
        f"then: dem new FOLDER --from {path}"
    )


def _row(method, q):
    unit = in_ascii(unit_of(q.unit)) if q.unit else ""
    # behind words, as an example's decimal point would count beside commas that are filled in
    example = f"; such as {q.example}" if q.example else ""
    asked = f"{q.text}{' (needed)' if q.needed else ''}{example}"
    return (method.name, q.key, "", unit, asked, q.allowed)


def read_filled(path: Path, sheet: str | None = None) -> list[Raw]:
    """[Raw] of all tests of a filled table. Raises `Faults` that name the lines, and ConfigError
    for a file that is no such table."""
    table, faults = read_table(path, sheet=sheet), []
    table.require(TEST, QUESTION, VALUE)
    filled = [(line, row) for line, row in table.rows if row[VALUE].strip()]
    if not filled:
        raise CalibrationError(
            f"{path}: holds no values; allowed: those of your tests in the column {VALUE}"
        )
    found: dict[str, list[dict]] = {}
    for (name, key), rows in groupby(
        filled, lambda r: (_plain(r[1][TEST]), _plain(r[1][QUESTION]))
    ):
        lines = list(rows)
        place = f"{path.name}, line {lines[0][0]}"
        method = methods().get(name)
        if method is None:
            known = ", ".join(methods())
            faults.append(f"{place}: {lines[0][1][TEST]} is no test; allowed: {known}")
            continue
        tests = found.setdefault(name, [{}])
        if key in tests[-1] and method.becomes:  # the same test once more, under another load
            tests.append({})
        tests[-1].setdefault(key, []).extend(_texts(path, method.question(key), lines, faults))
    raws = [
        Raw(name, answers, f"{path.name}, {name}")
        for name, tests in found.items()
        for answers in tests
    ]
    if faults:
        raise Faults([*faults, *_further(raws)])
    return raws


def _plain(cell):
    return cell.strip().lower()


def _texts(path, q, lines, faults):
    """[(text, place)] of a question's cells."""
    found = []
    for line, row in lines:
        place = f"{path.name}, line {line}"
        try:
            words = [row[VALUE].strip()] if q and (q.words or q.free) else separate(row[VALUE])
        except CalibrationError as error:
            faults.append(f"{place}: {error}")
            continue
        found += [(with_unit(q, word.strip(), row.get(UNIT, "").strip()), place) for word in words]
    return found


def _further(raws):
    """Faults of the answers that could be taken out of the table."""
    try:
        read_entries(raws)
    except Faults as more:
        return more.faults
    return []
