"""What a laboratory read as tables: the readings of a test in the table that its option names, the
rows as answers, each with its line; and the methods' questions as one table to fill in.

A row of that has a test, a question, a cell for its value, its unit, and in words what is asked.
What was read more than once stands in one cell (`26.1; 27.4`), or in copies of its row. A test that
was made under several loads, or from several heights, has its rows once for each.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby, product
from pathlib import Path

import pandas as pd

from calibration.errors import CalibrationError, ConfigError
from calibration.files import write_table
from calibration.intake.measurements import read_measured
from calibration.study.new.answers import Raw, entries_of, separate, with_unit
from calibration.study.new.methods import Method, Question, methods
from calibration.study.new.methods.declare import fault, refusal
from dem.io.files import replace_file
from dem.tables import Table, read_table
from dem.tables.dialect import plain
from dem.units import in_ascii, unit_of, without_unit

TABLES = (".csv", ".tsv", ".txt", ".xlsx")


_COMMA = re.compile(r"([+-]?\d+),(\d+)(\D.*)?")


def with_points(table: Table) -> Table:
    """The table, decimal commas in the text cells of a workbook as points: its numbers are numbers,
    and a cell that is text has the comma of who typed it. Raises ConfigError for `1,234`."""
    if table.path.suffix.lower() != ".xlsx":
        return table
    return replace(table, rows=tuple((n, _pointed(table, n, row)) for n, row in table.rows))


def _pointed(table, line, row):
    found = {heading: _COMMA.fullmatch(cell.strip()) for heading, cell in row.items()}
    for heading, comma in found.items():
        if comma and len(comma[2]) == 3:
            reason = f"can be read in two ways, {comma[1]}.{comma[2]} or {comma[1]}{comma[2]}"
            allowed = "one of these, best as a number"
            raise table.fault(line, heading, reason, value=row[heading], allowed=allowed)
    return row | {h: f"{m[1]}.{m[2]}{m[3] or ''}" for h, m in found.items() if m}


def is_table(word: str) -> bool:
    """Return whether a word of an option names a table."""
    return "=" not in word and Path(word).suffix.lower() in TABLES


def raws_of_tables(
    method: Method, files: Sequence[str], beside: Raw, sheet: str | None = None
) -> tuple[list[Raw], list[str]]:
    """([Raw], sentences) of the tables that an option names; beside: what its other words answer,
    which holds for all rows; sheet: of workbooks. The sentences name columns that are not read.

    Raises CalibrationError for readings or conditions that stand in both, and for a table without a
    column of what is read.
    """
    read = [key for key in beside.answers if (q := method.question(key)) and q.reading]
    if read:
        raise refusal("reading_beside", beside.answers[read[0]][0][1], files[0])
    found, said = [], []
    for file in files:
        raws, unread = _of_table(method, Path(file), sheet)
        found += [joined(raw, beside) for raw in raws]
        if unread:
            said.append(f"{file}: not read: {', '.join(unread)}")
    return found, said


def joined(raw: Raw, beside: Raw) -> Raw:
    """Answers with those beside them. Raises CalibrationError for one that stands in both."""
    if twice := raw.answers.keys() & beside.answers.keys():
        key = min(twice)
        places = beside.answers[key][0][1], raw.answers[key][0][1]
        raise refusal("in_both", key, *places)
    return Raw(raw.method, {**raw.answers, **beside.answers}, raw.place)


def _of_table(method, path, sheet):
    """([Raw], headings that are not read) of one table."""
    table = with_points(read_table(path, sheet=sheet))
    if "quantity" in table.header:
        return list(_of_measured(method, path, sheet)), []
    columns = _columns(method, table)
    faults = []
    rows = ((line, dict(_row(columns, table, line, row))) for line, row in table.rows)
    found = entries_of(path.name, method, [(n, row) for n, row in rows if row], faults)
    if faults:
        raise CalibrationError("\n".join(faults))
    if not found:
        raise ConfigError("has no readings", path=path, allowed="a row for each reading")
    return found, [heading for heading in table.header if heading not in columns]


def _columns(method: Method, table: Table) -> dict[str, Question]:
    """{heading: `Question`}. Raises ConfigError where two headings mean one question, or none is of
    what is read."""
    columns: dict[str, Question] = {}
    for heading in table.header:
        named = " ".join(re.split(r"[\s_]+", without_unit(heading))).lower()
        q = next((q for q in method.asked if named in _names(q)), None)
        if q in columns.values():
            first = next(h for h, other in columns.items() if other == q)
            reason = f"means the same as {first}"
            raise table.fault(table.header_line, heading, reason, allowed="one of them")
        columns |= {heading: q} if q else {}
    if not columns and len(table.header) == 1:
        return {table.header[0]: method.readings[0]}
    if not any(q.reading for q in columns.values()):
        raise ConfigError(
            f"has no column of what {method.name} reads", path=table.path, line=table.header_line,
            value=", ".join(table.header),
            allowed="; ".join(f"{' or '.join(_names(q))}: {q.text}" for q in method.readings),
        )  # fmt: skip
    return columns


def _names(q):
    """Headings that mean a question, in small letters."""
    own = (q.key, without_unit(q.unit) if q.unit else q.key)
    return list(dict.fromkeys([*(n.replace("_", " ") for n in own), *q.headings]))


def _row(columns, table, line, row):
    """(question's key, (text, place)) of the filled cells of a row. Numbers have a decimal point,
    by the table's own rule."""
    for heading, q in columns.items():
        cell = row[heading].strip()
        if cell:
            text = cell if q.words or q.free else plain(cell, table.decimal)
            unit = table.units.get(heading) or unit_of(heading)
            place = f"{table.path.name}, line {line}, column {heading}"
            yield q.key, (with_unit(q, text, unit), place)


def _of_measured(method: Method, path: Path, sheet: str | None) -> Iterator[Raw]:
    """`Raw` of each condition of a table of measured values, as `dem shear` and `dem bounce` write
    it."""
    conditions = read_measured(path, sheet=sheet).conditions
    levers = {other.unit: other for other in method.questions if other.unit and not other.reading}
    for q, m in product(method.readings, conditions):
        if m.quantity != without_unit(q.unit) or m.outcome:
            continue
        place, lines = f"{path.name}, line {m.line}", m.lines or [m.line] * len(m.readings)
        answers = {q.key: [(_said(q, m.value), place)], "n": [(str(m.n), place)]}
        answers |= {"sd": [(_said(q, m.sd), place)]} if m.sd is not None else {}
        if m.readings:
            told = zip(m.readings, lines, strict=True)
            answers = {q.key: [(_said(q, v), f"{path.name}, line {n}") for v, n in told]}
        own = {levers[key]: value for key, value in m.levers.items() if key in levers}
        answers |= {other.key: [(_said(other, value), place)] for other, value in own.items()}
        yield Raw(method.name, answers, path.name)


def _said(q, value):
    return f"{value:.9g} {unit_of(q.unit)}"


TEST, QUESTION, VALUE, UNIT = "test", "question", "value", "unit"
COLUMNS = (TEST, QUESTION, VALUE, UNIT, "asked for", "allowed")


def write_empty(path: Path) -> str:
    """Write a table to be filled in, as CSV or as a workbook; returns a sentence. Raises
    CalibrationError for a file that exists or is called otherwise."""
    kind = path.suffix.lower()
    if kind not in (".csv", ".xlsx"):
        raise refusal("no_table_name", path)
    if path.exists():
        raise refusal("table_exists", path)
    rows = []
    for method in methods().values():
        # a table in place of readings is for options
        for q in (q for q in method.asked if not (q.free and q.option and method.readings)):
            unit = in_ascii(unit_of(q.unit)) if q.unit else ""
            # behind words: an example's decimal point would count beside commas that are filled in
            example = f"; such as {q.example}" if q.example else ""
            asked = f"{q.text}{' (needed)' if q.needed else ''}{example}"
            rows.append((method.name, q.key, "", unit, asked, q.allowed))
    if kind == ".csv":
        write_table(pd.DataFrame(rows, columns=COLUMNS), path)
    else:
        import openpyxl  # takes a quarter of a second

        book = openpyxl.Workbook()
        for row in (COLUMNS, *rows):
            book.active.append(row)
        for column, width in zip("ABCDEF", (16, 12, 24, 10, 70, 30), strict=True):
            book.active.column_dimensions[column].width = width
        book.active.freeze_panes = "D2"
        replace_file(path, book.save)
    return (
        f"wrote {path}, a row a question. Fill in the column {VALUE} of the tests that you made, "
        f"then: dem new FOLDER --from {path}"
    )


def read_filled(path: Path, sheet: str | None = None) -> tuple[list[Raw], list[str]]:
    """([Raw] of all tests of a filled table, faults that name their lines). Raises ConfigError for
    a file that is no such table."""
    table, faults = read_table(path, sheet=sheet), []
    table.require(TEST, QUESTION, VALUE)
    filled = [(line, row) for line, row in table.rows if row[VALUE].strip()]
    if not filled:
        raise refusal("nothing_filled_in", path, VALUE)
    found: dict[str, list[dict]] = {}
    for (name, key), lines in _questions(filled):
        place = f"{path.name}, line {lines[0][0]}"
        method = methods().get(name)
        if method is None:
            faults.append(fault("no_test", place, lines[0][1][TEST], methods()))
            continue
        tests = found.setdefault(name, [{}])
        if key in tests[-1] and method.under:  # the same test once more, under another load
            tests.append({})
        tests[-1].setdefault(key, []).extend(_texts(path, method.question(key), lines, faults))
    raws = [
        Raw(name, answers, f"{path.name}, {name}")
        for name, tests in found.items()
        for answers in tests
    ]
    return raws, faults


def _questions(filled):
    """((test, question), rows) of filled rows in any order; those of a test that was made under
    several loads stay in theirs, which says what was read under which."""
    for name in dict.fromkeys(_plain(row[TEST]) for _, row in filled):
        rows = [r for r in filled if _plain(r[1][TEST]) == name]
        keys = [_plain(row[QUESTION]) for _, row in rows]
        method = methods().get(name)
        if not method or keys.count(method.under) < 2:
            rows.sort(key=lambda r: keys.index(_plain(r[1][QUESTION])))
        for key, lines in groupby(rows, lambda r: _plain(r[1][QUESTION])):
            yield (name, key), list(lines)


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
