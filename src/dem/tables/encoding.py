"""From the bytes of a file to lines of text: what kind of file it is, and how its letters are
written."""

import codecs
import io
import re
import zipfile
from pathlib import Path

from dem.errors import InputError
from dem.tables.limits import LONGEST_CELL, check_unpacked

SAVE_AS = "CSV or tab-separated text, or a workbook .xlsx"
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
        raise InputError(found, path=path, allowed=SAVE_AS)
    named = path.suffix.lower() in (".xlsx", ".xlsm")
    if not data.startswith(b"PK\x03\x04"):
        if named:
            reason = "is named as a workbook and is none"
            raise InputError(reason, path=path, allowed="a name ending in .csv where it is text")
        return False
    if not _holds_workbook(data, path):
        reason = "is a compressed file and no workbook (OpenDocument, or a zip archive)"
        raise InputError(reason, path=path, allowed=SAVE_AS)
    if not named:
        reason = f"is an Excel workbook under the name of a {path.suffix or 'text'} file"
        allowed = f"{path.stem}.xlsx, or the table saved as CSV"
        raise InputError(reason, path=path, allowed=allowed)
    return True


def _holds_workbook(data, path):
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            if "xl/workbook.xml" not in packed.namelist():
                return False
            check_unpacked(packed, path)
    except InputError:
        raise
    except Exception:  # its directory may be damaged in a dozen ways
        return False
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
        raise InputError("is not text", path=path, allowed="UTF-8, UTF-16 or cp1252")
    _check_lengths(text, path)
    return text, encoding.removesuffix("-sig")


def _check_lengths(text, path):
    """Raise InputError for a line with a cell that is longer than any note: a file of another
    kind."""
    for number, line in enumerate(split_lines(text), 1):
        longest = max(re.split("[\t;,]", line), key=len) if len(line) > LONGEST_CELL else ""
        if len(longest) > LONGEST_CELL:
            raise InputError(
                "has a cell that is longer than any note", path=path, line=number,
                value=f"{longest[:40]}... ({len(longest):,} characters)",
                allowed=f"at most {LONGEST_CELL:,} characters",
            )  # fmt: skip


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
