"""A table as the engine, for codes that cannot be called: `design.csv` goes out, `responses.csv`
comes back.

Each stage's `design.csv` lists its points with their `run_id`. Whoever runs the other code writes
one row a run into the table that `engine.responses` names: `run_id` and a column for each metric.
What is missing is listed; what is not a number is an error by line.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from calibration.engines import Engine, EngineError, Settings
from calibration.errors import ConfigError
from dem.spec import RunSpec
from dem.tables import read_table


class TableSettings(Settings):
    """Where the responses are."""

    responses: str = Field(
        min_length=1, description="table with run_id and a column for each metric"
    )
    code: str = Field(min_length=1, description="name and version of the code that made them")


def identity(settings: Any) -> dict[str, Any]:
    """The code as the user names it."""
    return {"code": settings.code}


def simulate(
    spec: RunSpec, folder: Path, entry: Mapping[str, Any]
) -> tuple[dict[str, float], dict[str, Any]]:
    """(metrics, {}) of the run that `folder` is named after. Raises EngineError while its row
    is missing."""
    return read_row(entry["settings"]["responses"], Path(folder).name), {}


def read_row(path: str | Path, run_id: str) -> dict[str, float]:
    """{metric: value} of one run in the table of responses. Raises EngineError."""
    if not Path(path).is_file():
        raise EngineError(f"{path}: there is no such file; write the responses there")
    try:
        table = read_table(path)
        table.require("run_id")
        rows = [(line, row) for line, row in table.rows if row["run_id"] == run_id]
        if len(rows) != 1:
            lines = ", ".join(str(line) for line, _ in rows)
            found = f"stands in several lines: {lines}" if rows else "has no row yet"
            raise EngineError(f"{path}: the run {run_id} {found}")
        [(line, row)] = rows
        given = ((name, text) for name, text in row.items() if name != "run_id" and text != "")
        return {name: table.number(line, name, text) for name, text in given}
    except ConfigError as error:
        raise EngineError(str(error)) from None


def changed(result: Mapping[str, Any], name: str) -> str | None:
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


ENGINE = Engine("table", TableSettings, (), identity, simulate, changed=changed)
