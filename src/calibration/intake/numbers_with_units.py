"""Numbers of a user's tables: with a unit of their own or in the key's, and plausible there."""

import re
from collections.abc import Mapping
from functools import partial
from typing import Any

from calibration.errors import at_key
from calibration.intake.tables import Table
from dem.units import UnitError, converted, has_unit, in_unit, question, unit_of

DIFFERENCES = ("discrepancy",)
"""Sections whose keys are metrics and whose numbers are differences of them: any may be small."""

LARGEST = 1e300
"""Of a bare number: YAML has whole numbers that are no float."""
AT_ITS_WORD = "a plausible number, or one with its unit, which is taken at its word"


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
        raise table.fault(line, column, f"is doubtful: {asked}", text, AT_ITS_WORD)
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
                raise at_key(name, f"is doubtful: {asked}", item, AT_ITS_WORD)


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
