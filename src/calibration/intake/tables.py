"""Tables of a study: those that people give, by the engine's reader (`dem.tables`) with the errors
of a study, the plausible numbers in them, with a unit of their own or in the key's, what was read
said back, and those that a stage wrote."""

import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from calibration.errors import CONFIGURATION, ConfigError, at_key
from dem.io.files import rows_of
from dem.tables import Table
from dem.units import UnitError, converted, has_unit, in_unit, question, unit_of

_REFUSALS = {row["key"]: row for row in rows_of(Path(__file__).with_name("refusals.csv"))}


def refused(fault: str, path: Any = None, **facts: Any) -> ConfigError:
    """`ConfigError` of a fault of refusals.csv, whose texts name some of the facts; path (a file or
    an option), line, column, key and value are those of the error."""
    told, where = _REFUSALS[fault], {k: facts.get(k) for k in ("line", "column", "key", "value")}
    reason, allowed = (told[text].format(**facts) for text in ("reason", "allowed"))
    return ConfigError(reason, path=path, allowed=allowed or None, **where)


def summary(values: ArrayLike, unit: str = "", how: str = "") -> str:
    """One line: `10 values, 26.1° to 28.4°, mean 27.40° ± 0.8° (sd)`, and how the table was
    recognised. One value is said once."""
    values = np.asarray(values, float)
    if len(values) == 1:
        return f"1 value, {values[0]:.4g}{unit}" + (f" ({how})" if how else "")
    largest = float(np.abs(values).max())  # four digits of it tell the decimals of the mean
    digits = int(np.clip(3 - np.floor(np.log10(largest)), 0, 6)) if largest > 0 else 1
    text = f"{len(values)} values, {values.min():.4g}{unit} to {values.max():.4g}{unit}, "
    text += f"mean {values.mean():.{digits}f}{unit} ± {values.std(ddof=1):.2g}{unit}"
    return f"{text} ({how})" if how else text


def read_written(path: str | Path, **options: Any) -> pd.DataFrame:
    """Data frame of a CSV file that a stage wrote: commas, points, UTF-8, nothing to recognise;
    options go to pandas. Raises ConfigError where it is none."""
    try:
        return pd.read_csv(path, **options)
    except OSError as error:
        raise ConfigError(f"cannot be read ({error.strerror})", path=path) from None
    except ValueError as error:  # what pandas raises for an empty, ragged or binary file
        reason = f"is not the table that a stage wrote ({str(error).splitlines()[0]})"
        raise ConfigError(reason, path=path, allowed="delete it; it is then made again") from None


DIFFERENCES = ("discrepancy",)
"""Sections whose keys are metrics and whose numbers are differences of them: any may be small."""

LARGEST = 1e300
"""Of a bare number: YAML has whole numbers that are no float."""


def plausible_number(table: Table, line: int, column: str, text: str, key: str) -> float:
    """Number of a cell in the unit that `key` ends in: its own unit counts first, then the
    heading's.

    Raises ConfigError for what is no number, a unit of another kind, or a bare number that no
    material has.
    """
    unit, heading = unit_of(key), table.units.get(column)
    bare = not has_unit(text.replace(",", "."))
    if bare and heading and unit and has_unit(f"1 {heading}"):
        return table.number(line, column, text, lambda x: in_unit(f"{x} {heading}", unit))
    value = table.number(line, column, text, partial(in_unit, unit=unit))
    asked = question(key, value) if bare else None
    if asked:
        raise refused("doubtful", table.path, line=line, column=column, value=text, asked=asked)
    return value


def check_plausible(data: Mapping[str, Any], prefix: str = "") -> None:
    """Raise ConfigError for the first bare number of a nested mapping that no material or rig
    has."""
    for key, value in data.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict) and key not in DIFFERENCES:
            check_plausible(value, f"{name}.")
        for item in value if isinstance(value, list) else [value]:
            if isinstance(item, int) and abs(item) > LARGEST:
                raise at_key(name, "is no number", item, f"at most {LARGEST:g}")
            asked = question(name, item)
            if asked:
                raise refused("doubtful", CONFIGURATION, key=name, value=item, asked=asked)


def in_key_units(data: dict[str, Any]) -> dict[str, Any]:
    """A configuration with each value that carries a unit as a number in its key's unit. Raises
    ConfigError."""
    try:
        return converted(data)
    except UnitError as error:
        where = vars(error)  # `converted` notes the key and its value
        raise at_key(where["key"], str(error), where["value"]) from None


_LEADING_COMMA = re.compile(r"([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)(?!\d)")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+(?![\d,.])")


def said_number(text: str, unit: str | None) -> float:
    """Number of a text that a person typed, with or without a unit, in `unit`: `26.1`, `26,1`,
    `1,32 g/cm3`. The same rule as in tables: a comma in a number is a decimal mark where no other
    reading is left; `1,234` could be a thousand.

    Raises UnitError for what is no number, has two readings or a unit of another kind.
    """
    text = str(text).strip()
    if len(text) > 100:
        raise UnitError("is not a number")
    if grouped := _THOUSANDS.match(text):
        point, without = grouped[0].replace(",", ".", 1), grouped[0].replace(",", "")
        raise UnitError(f"can be read in two ways, {point} or {without}; allowed: one of these")
    match = _LEADING_COMMA.match(text)
    if match and "," not in text[match.end() :] and "." not in match[0]:
        text = f"{match[1]}.{match[2]}{text[match.end() :]}"
    return in_unit(text, unit)
