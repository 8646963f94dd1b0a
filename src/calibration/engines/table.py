"""A table as the engine, for codes that cannot be called: `design.csv` goes out, `responses.csv`
comes back.

Each stage's `design.csv` lists its points with their `run_id`. Whoever runs the other code writes
one row a run into the
table that `engine.responses` names: `run_id` and a column for each metric. What is missing is
listed; what is
not a number is an error by line.
"""

import csv
import math
from pathlib import Path

from pydantic import Field

from calibration.engines import Engine, EngineError, Settings


class TableSettings(Settings):
    """Where the responses are."""

    responses: str = Field(
        min_length=1, description="table with run_id and a column for each metric"
    )
    code: str = Field(min_length=1, description="name and version of the code that made them")


def identity(settings):
    """The code as the user names it."""
    return {"code": settings.code}


def refuse(spec):
    """What the code can represent is the user's affair."""


def simulate(spec, folder, entry):
    """(metrics, {}) of the run that `folder` is named after. Raises EngineError while its row
    is missing."""
    return read_row(entry["settings"]["responses"], Path(folder).name), {}


def read_row(path, run_id):
    """{metric: value} of one run in the table of responses. Raises EngineError."""
    rows = [(line, row) for line, row in _rows(path) if row["run_id"] == run_id]
    if not rows:
        raise EngineError(f"{path} has no row for the run {run_id} yet")
    if len(rows) > 1:
        lines = ", ".join(str(line) for line, _ in rows)
        raise EngineError(f"{path}: the run {run_id} stands in several lines: {lines}")
    line, row = rows[0]
    return {
        name: _number(path, line, name, text)
        for name, text in row.items()
        if name != "run_id" and text not in (None, "")
    }


def _rows(path):
    try:
        with open(path, newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream)
            if "run_id" not in (reader.fieldnames or ()):
                raise EngineError(f"{path}, line 1: needs a column run_id")
            return [(reader.line_num, row) for row in reader]
    except OSError as error:
        raise EngineError(f"{path}: {error.strerror}; write the responses there") from None


def _number(path, line, name, text):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise EngineError(f"{path}, line {line}, {name}: {text!r} is not a number")
    return value


def changed(result, name):
    """Sentence where a run's row in the table is another one than its kept result was read from,
    else None."""
    path = result["spec"]["engine"]["settings"]["responses"]
    try:
        row = read_row(path, name)
    except EngineError as error:
        return str(error)
    if row == result["metrics"]:
        return None
    return f"{path}: the row of {name} has changed since it was read"


ENGINE = Engine("table", TableSettings, (), identity, refuse, simulate, changed)
