"""The answer of a study as a workbook: the parameters, intervals and how to cite them."""

import io
import re
import zipfile
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any

from dem.fingerprint import engine_fingerprint

PACKAGE = "granular-calibration"
WRITTEN = (1980, 1, 1, 0, 0, 0)
"""Time of a file within these: the same study makes the same bytes."""


def program() -> str:
    """This package and its version, as a citation names it."""
    return f"{PACKAGE} {metadata.version(PACKAGE)}"


def citation(name: str) -> str:
    """How to cite a study's answer: the program, its version and that of its engine."""
    return (
        f"Cite as: the granular-calibration developers, {program()} "
        f"(engine {engine_fingerprint()}), study “{name}”."
    )


def workbook(name: str, answer: Mapping[str, Any], findings: Sequence[tuple[str, str]]) -> bytes:
    """A workbook: a sheet of every parameter, one of every measured value, one of words; answer: as
    the page has it; findings: (heading, text). Values that are numbers stand as numbers."""
    import openpyxl  # takes a quarter of a second

    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, table in (("parameters", answer["block"]), ("tests", answer["tests"])):
        if table:
            _table_sheet(book.create_sheet(title), table)
    words = book.create_sheet("words")
    for row in answer["first"]:
        words.append([row["name"], f"{row['value']}: {row['known']}"])
    words.append(["What is wrong", answer["wrong"]])
    if answer["next"]:
        words.append(["What to measure next", answer["next"]])
    for line in (*findings, ("", citation(name))):
        words.append(list(line))
    words.column_dimensions["A"].width, words.column_dimensions["B"].width = 30, 100
    kept = io.BytesIO()
    book.save(kept)
    return _at_one_time(kept.getvalue())


def _table_sheet(sheet, table):
    from openpyxl.styles import Font

    sheet.append(list(table[0]))
    for row in table:
        sheet.append([_number(text) for text in row.values()])
    for cell in sheet[1]:
        cell.font = Font(bold=True)
        sheet.column_dimensions[cell.column_letter].width = 30


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text


def _at_one_time(package):
    """The same package with one time in it, in place of that of its making."""
    kept = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(package)) as old, zipfile.ZipFile(kept, "w") as new:
        for entry in old.namelist():
            text = old.read(entry)
            if entry == "docProps/core.xml":
                text = re.sub(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", b"1980-01-01T00:00:00Z", text)
            new.writestr(zipfile.ZipInfo(entry, WRITTEN), text, zipfile.ZIP_DEFLATED)
    return kept.getvalue()
