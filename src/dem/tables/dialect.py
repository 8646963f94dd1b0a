"""How the cells of a text table are separated and its decimals marked: one consistent reading, or
an error with both.

A separator counts where it gives every row the header's number of cells. A comma in a number is a
decimal mark if no other reading is left. `1,234` alone could be a thousand.
"""

import csv
import re
from collections.abc import Sequence
from pathlib import Path

from dem.errors import refused

NAMES = {
    "\t": "tab-separated", ";": "semicolon-separated", ",": "comma-separated", "": "one column",
}  # fmt: skip
_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_POINT = re.compile(r"[+-]?\d*\.\d+(?:[eE][+-]?\d+)?")
_COMMA_GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+")
_POINT_GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(?:\.\d{3})+")
_GERMAN = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+,\d+")
_ENGLISH = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+\.\d+")
_LEADING = re.compile(r"\s*([+-]?[\d.,]*\d(?:[eE][+-]?\d+)?)")


def cells_of(text: str, separator: str, path: str | Path, line: int) -> list[str]:
    """Cells of one line, stripped. Raises InputError where a quotation mark is not closed,
    or a cell is longer than any."""
    try:
        (cells,) = csv.reader([text], delimiter=separator or "\t", strict=True)
    except (csv.Error, ValueError):
        fault = "open quote" if '"' in text else "long quote"
        raise refused(fault, path=path, line=line, value=text.strip()[:60]) from None
    return [c.strip() for c in cells]


def separator_of(
    lines: Sequence[tuple[int, str]], path: str | Path, declared: str | None = None
) -> str:
    """Separator of [(line, text)], the header first. Raises InputError where two fit or the rows
    do not."""
    if declared is not None:
        if declared not in (*NAMES, "|"):
            raise refused("no separator", path=path, line=1, value=f"sep={declared}")
        return declared
    line, header = lines[0]
    found = [s for s in ("\t", ";", ",") if len(cells_of(header, s, path, line)) > 1]
    if len(found) > 1:
        # the one that gives no row more cells than the header has
        counts = {s: [len(cells_of(text, s, path, n)) for n, text in lines] for s in found}
        found = [s for s in found if max(counts[s]) == counts[s][0]] or found
    if len(found) > 1:
        rows = [f"{' | '.join(cells_of(header, s, path, line))} ({NAMES[s]})" for s in found]
        raise refused("separators", path=path, line=line, readings=" or ".join(rows))
    if not found:
        _check_single(lines, path)
    return found[0] if found else ""


def _check_single(lines, path):
    """Rows under a single heading hold one cell each; a comma in it must be a decimal mark."""
    for line, text in lines[1:]:
        for separator in ("\t", ";"):
            if len([c for c in cells_of(text, separator, path, line) if c]) > 1:
                told = {"value": text.strip(), "header": lines[0][1].strip()}
                raise refused("more cells", path=path, line=line, **told)
    values = [(n, text.strip().strip('"').rstrip(";\t")) for n, text in lines[1:]]
    counted = [text.split(",")[0] for _, text in values if _COMMA.fullmatch(text)]
    # as the first of two columns counts the rows of a table
    up = [str(k) for k in range(1 + len(counted))]
    if len(counted) > 1 and len(counted) == len(values) and counted in (up[:-1], up[1:]):
        line, text = values[0]
        halves = dict(zip(("first", "second"), text.split(","), strict=True))
        raise refused("comma or column", path=path, line=line, value=text, **halves)


def decimal_of(rows: Sequence[tuple[int, list[str]]], separator: str, path: str | Path) -> str:
    """Decimal mark of [(line, cells)]. Raises InputError for a mixture, or where thousands fit."""
    cells = [(line, number) for line, row in rows for cell in row if (number := _number_in(cell))]
    commas = [(n, c) for n, c in cells if _COMMA.fullmatch(c) or _GERMAN.fullmatch(c)]
    points = [(n, c) for n, c in cells if _POINT.fullmatch(c) or _ENGLISH.fullmatch(c)]
    # thousands of one kind may stand beside decimals of the other
    for mark, own, whole, other, groups in (
        (",", commas, _GERMAN, points, _POINT_GROUPS),
        (".", points, _ENGLISH, commas, _COMMA_GROUPS),
    ):
        only_groups = other and all(groups.fullmatch(c) for _, c in other)
        if only_groups and any(whole.fullmatch(c) for _, c in own):
            return mark
    if commas and points:
        (line, comma), (other, point) = commas[0], points[0]
        raise refused("both marks", path=path, line=line, comma=comma, point=point, other=other)
    if commas:
        return _of_one(commas, _COMMA_GROUPS, ",", path)
    # a spreadsheet that separates by semicolons writes decimal commas
    if points and separator == ";":
        return _of_one(points, _POINT_GROUPS, ".", path)
    return "."


def _number_in(cell):
    """The number that a cell begins with, without its unit. None for words, codes and cells that
    only hold digits."""
    match = _LEADING.match(cell)
    if not match or not re.fullmatch(r"(\s*[^\d\s.,;]\S*)?", cell[match.end() :]):
        return None
    return match[1] if any(mark in match[1] for mark in ".,") else None


def _of_one(cells, groups, mark, path):
    if any(not groups.fullmatch(c) for _, c in cells):
        return mark
    line, text = cells[0]
    ways = {"decimal": text.replace(mark, "."), "whole": text.replace(mark, "")}
    name = "comma" if mark == "," else "point"
    raise refused("thousands", path=path, line=line, value=text, name=name, **ways)


def plain(text: str, decimal: str) -> str:
    """A number's text with a decimal point and without marks between thousands."""
    if decimal == ",":
        return text.replace(".", "").replace(",", ".")
    match = _LEADING.match(text)
    grouped = match and (_ENGLISH.fullmatch(match[1]) or _COMMA_GROUPS.fullmatch(match[1]))
    return text.replace(",", "") if grouped else text
