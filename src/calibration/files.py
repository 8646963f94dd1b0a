"""Files of a study: texts and tables written so that nothing half written is ever found under their
name, and records read."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from dem.io.files import replace_file

if TYPE_CHECKING:  # pandas takes a while to load, and most of who write a file need none of it
    import pandas as pd

FORMULA = ("=", "+", "-", "@")
"""What a formula of a spreadsheet begins with."""


class DamagedError(InputError, ValueError):
    """A file that the project wrote and that is no longer what it was."""


def read_json(path: str | Path) -> Any:
    """Content of a JSON file that a stage wrote. Raises OSError, and DamagedError for what is no
    JSON."""
    try:
        return json.loads(Path(path).read_text("utf-8"))
    except (ValueError, RecursionError) as error:
        line = getattr(error, "lineno", None)
        again = "the file as it was written; delete it, and the next start makes it again"
        raise DamagedError("is damaged: no JSON", path=path, line=line, allowed=again) from None


def set_aside(path: Path, folder: Path | None = None) -> None:
    """Rename a file to FILE.damaged, or FILE.damaged.2 and so on: what was set aside before stays.
    folder: to put it into, unless beside the file. Raises OSError."""
    name, number = f"{path.name}.damaged", 1
    taken = (folder or path.parent) / name
    while os.path.lexists(taken):
        number += 1
        taken = taken.with_name(f"{name}.{number}")
    os.replace(path, taken)


def write_text(text: str, path: str | Path) -> None:
    """Write a text file."""
    replace_file(path, lambda stream: stream.write(text.encode()))


def write_table(table: "pd.DataFrame", path: str | Path) -> None:
    """Write a data frame as CSV, as `csv_text` gives it."""
    write_text(csv_text(table), path)


def csv_text(table: "pd.DataFrame") -> str:
    """A data frame as CSV in which no cell and no heading is a formula to a spreadsheet: what
    begins like one gets an apostrophe in front (OWASP, CSV injection). Numbers stay as they are."""
    shown = table.rename(columns=_no_formula)
    texts = shown.select_dtypes(exclude="number").columns
    return shown.assign(**{c: shown[c].map(_no_formula) for c in texts}).to_csv(index=False)


def _no_formula(cell):
    if not (isinstance(cell, str) and cell.lstrip().startswith(FORMULA)):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell
