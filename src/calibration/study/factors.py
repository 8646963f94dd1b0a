"""The table of a study's factors, and what is physically possible of one, by the limits of the run
spec's own keys."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from types import UnionType
from typing import Any, get_args

from pydantic import BaseModel

from calibration.errors import ConfigError
from calibration.intake.tables import plausible_number
from calibration.statistics.factor import Factor
from dem.spec import GEOMETRY, RunSpec
from dem.tables import read_table

__all__ = ["Factor"]

COLUMNS = ("code", "name", "key", "low", "high", "description")

NAME = r"[^\W\d_][\w .()-]*"
"""Code or name of a factor: headings of tables, in which a spreadsheet sees no formula."""

RESERVED = set(
    "run replicate group path fold seed experiment run_id response response_sd "
    "relative_error".split()
)


def read_factors(path: str | Path) -> list[Factor]:
    """Factors from a table with the columns COLUMNS. Raises ConfigError naming file, line and
    column."""
    table = read_table(path)
    if not table.rows:
        raise ConfigError(
            "has no factors", path=path, allowed=f"a line each, columns {', '.join(COLUMNS)}"
        )
    missing = [c for c in COLUMNS[:5] if c not in table.header]
    if missing:
        reason = f"lacks {', '.join(missing)}"
        raise ConfigError(
            reason, path=path, line=table.header_line, allowed=f"the columns {', '.join(COLUMNS)}"
        )
    factors = [_factor(table, line, row) for line, row in table.rows]
    _check_names(factors, table)
    return factors


def _check_names(factors, table):
    """Raise ConfigError for what stands twice, or is a column of the design tables."""
    for field in ("code", "name", "key"):
        values = [getattr(f, field) for f in factors]
        for k, v in enumerate(values):
            if v in values[:k]:
                line = table.rows[k][0]
                raise table.fault(line, field, "stands twice", value=v)
    # codes and names are the columns of the design tables
    taken = {f.code for f in factors} | RESERVED
    for f, (line, _) in zip(factors, table.rows, strict=True):
        for field, used in (("code", RESERVED), ("name", taken)):
            if getattr(f, field) in used:
                reason = "is the name of another column of the design tables"
                raise table.fault(line, field, reason, value=getattr(f, field))


def factor_of(factors: Sequence[Factor], key: str) -> Factor:
    """The factor that sets the dotted `key` of a run spec. Raises ConfigError where none does."""
    for factor in factors:
        if factor.key == key:
            return factor
    raise ConfigError("no factor sets it", key=key, allowed=", ".join(f.key for f in factors))


def _factor(table, line, row):
    for column in ("code", "name", "key"):
        if not row[column]:
            raise table.fault(line, column, "is empty")
    for column in ("code", "name"):
        if not re.fullmatch(NAME, row[column]):
            allowed = "a letter, then letters, digits, blanks, _, -, . and brackets"
            reason = f"is no {column} of a factor"
            raise table.fault(line, column, reason, value=row[column], allowed=allowed)
    given = row["code"], row["name"], row["key"]
    low, high = (plausible_number(table, line, c, row[c], row["key"]) for c in ("low", "high"))
    if low >= high:
        allowed = f"more than {low:g}"
        raise table.fault(line, "high", "must be above low", value=high, allowed=allowed)
    return Factor(*given, low, high, row.get("description", ""))


def physical_range(key: str, experiment: str) -> tuple[float, float]:
    """(low, high) that the dotted `key` of a run spec allows; infinite where it states no limit.

    A limit that is itself not allowed (above 0, below 0.5) is moved in by a billionth of itself or
    of 1.
    """
    model: type[BaseModel] | None = RunSpec
    names = key.split(".")
    if names[0] == "geometry":
        model, names = GEOMETRY[experiment], names[1:]
    for name in names[:-1]:
        info = model.model_fields.get(name) if model else None
        model = section_of(info.annotation) if info else None
    info = model.model_fields.get(names[-1]) if model else None
    low, high = -math.inf, math.inf
    for limit in info.metadata if info else ():
        if hasattr(limit, "ge"):
            low = max(low, limit.ge)
        if hasattr(limit, "gt"):
            low = max(low, limit.gt + 1e-9 * max(abs(limit.gt), 1.0))
        if hasattr(limit, "le"):
            high = min(high, limit.le)
        if hasattr(limit, "lt"):
            high = min(high, limit.lt - 1e-9 * max(abs(limit.lt), 1.0))
    return low, high


def section_of(annotation: Any) -> type[BaseModel] | None:
    """The schema of a nested section, also where it may be left out; None for any other key."""
    parts = get_args(annotation) if isinstance(annotation, UnionType) else (annotation,)
    found = (p for p in parts if isinstance(p, type) and issubclass(p, BaseModel))
    return next(found, None)


def inside(centre: float, half: float, low: float, high: float) -> tuple[float, float]:
    """(centre, half) of the levels centre -+ half moved, and where they are too wide narrowed, into
    [low, high]."""
    half = min(half, 0.5 * (high - low))
    return min(max(centre, low + half), high - half), half
