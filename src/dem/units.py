"""Units at the border: `1.35 g/cm3` under a key that ends in a unit, and the question a doubtful
value gets back.

A key carries its unit as its ending (`density_kg_m3`, units.csv). A value may carry its own; it is
then converted. A bare number is in the key's unit and must be plausible there (plausible.csv): a
slip of the unit moves it by powers of ten.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dem.io.files import rows_of

UNITS = {row["ending"]: row["unit"] for row in rows_of(Path(__file__).with_name("units.csv"))}
"""Ending of a key -> its unit; longer endings come first."""

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_WITH_UNIT = re.compile(rf"\s*({NUMBER})\s*([^\s,.'].*?)?\s*\Z")
_POWER = re.compile(r"(?<=[A-Za-zµμ°)])(-?\d)")
_ON_THE_LINE = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_SPELLED = re.compile(r"[A-Za-zµμ°%\"][A-Za-zµμ°%/*·^()\d\s.⁻⁰¹²³⁴⁵⁶⁷⁸⁹-]*|1\s*/\s*[A-Za-zµμ]+")


class UnitError(ValueError):
    """A value whose unit is unknown or of another kind; the message says which and what is
    allowed."""


def unit_of(key: str) -> str | None:
    """Unit that a key ends in (`density_kg_m3` -> `kg/m³`; `diameters_mm` too), None where it ends
    in none."""
    return next((unit for ending, unit in UNITS.items() if key.endswith(ending)), None)


def without_unit(key: str) -> str:
    """A key without the unit at its end (`angle_of_repose_deg` -> `angle_of_repose`)."""
    ending = next((ending for ending in UNITS if key.endswith(ending)), "")
    return key.removesuffix(ending)


def behind(unit: str | None) -> str:
    """A unit as it is written behind a number: `°` without a space, nothing for None or ""."""
    return unit if unit == "°" else f" {unit}" if unit else ""


def in_ascii(unit: str | None) -> str:
    """A unit as files for other programs have it: `kg/m3`, `deg`, `Pa s`; `1` for None."""
    return (unit or "1").translate(_ON_THE_LINE).replace("·", " ").replace("°", "deg")


def in_unit(text: str | float, unit: str | None) -> float:
    """Number of `text`, with or without a unit of its own, in `unit` (None: a number without one).

    Raises UnitError where it is no number, its unit is unknown or of another kind.
    """
    match = _WITH_UNIT.match(str(text))
    if not match and str(text).strip().lower() in ("inf", "-inf", "nan"):
        return float(text)
    if not match:
        raise UnitError("is not a number")
    number, own = float(match[1]), match[2]
    if own is None:
        return number
    if unit is None:
        raise UnitError("takes no unit")
    return _convert(number, own, unit)


def has_unit(value: object) -> bool:
    """Return whether a value is a text of a number and a unit."""
    match = _WITH_UNIT.match(value) if isinstance(value, str) else None
    return bool(match and match[2] and _SPELLED.fullmatch(match[2]))


def converted(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """A copy of nested mappings and lists in which each text of a number and a unit is a number in
    its key's unit.

    Raises UnitError, whose attribute `key` is the dotted key and `value` what stood there.
    """
    return {k: _entry(v, f"{prefix}{k}", str(k)) for k, v in data.items()}


def _entry(value, place, key):
    if isinstance(value, dict):
        return converted(value, f"{place}.")
    if isinstance(value, list):
        places = (f"{place}.{n}" if isinstance(v, dict) else place for n, v in enumerate(value))
        return [_entry(v, at, key) for v, at in zip(value, places, strict=True)]
    unit = unit_of(key)
    if unit is None or not has_unit(value):
        return value
    try:
        return in_unit(value, unit)
    except UnitError as error:
        error.key, error.value = place, value
        raise


def _convert(number, own, unit):
    import pint  # takes half a second, which a study without units need not wait for

    if not _SPELLED.fullmatch(own):
        raise UnitError(f"{own!r} is no unit; allowed: {unit} or another unit of its kind")
    try:
        quantity = number * pint.application_registry.parse_units(_spelled(own))
        # rounded to the digits of a decimal number: 1.35 g/cm3 is 1350 kg/m3, not
        # 1350.0000000000002
        return float(f"{quantity.to(_spelled(unit)).magnitude:.15g}")
    except pint.DimensionalityError:
        allowed = f"allowed: {unit}, or what converts to it"
        raise UnitError(f"{own} is of another kind; {allowed}") from None
    except Exception:  # the library's parser has a dozen kinds of errors for what is no unit
        raise UnitError(
            f"{own!r} is no known unit; allowed: {unit} or another unit of its kind"
        ) from None


def _spelled(unit):
    """A unit as the library reads it: powers by `**`, products by `*`."""
    text = unit.translate(_ON_THE_LINE).replace("·", "*").replace("^", "").replace('"', "inch")
    return _POWER.sub(r"**\1", text)


BANDS = [
    (re.compile(row["key"]), float(row["low"]), float(row["high"]), row["slips"].split())
    for row in rows_of(Path(__file__).with_name("plausible.csv"))
]
"""(keys, least, most, units that are written there by mistake): values outside are asked about.
The bands hold every grain from silt to boulders."""


def question(key: str, value: object) -> str | None:
    """The question that a bare number gets back which no material or rig has, else None.

    Of the units written by mistake it names those under which the number would be plausible.
    """
    band = next((b for b in BANDS if b[0].search(key)), None)
    if band is None or not isinstance(value, int | float) or isinstance(value, bool) or value <= 0:
        return None
    _, low, high, slips = band
    if low <= value <= high:
        return None
    unit = unit_of(key)
    guesses = [(slip, _convert(value, slip, unit)) for slip in slips]
    asked = [f"{value:g} {slip} ({x:.4g} {unit})" for slip, x in guesses if low <= x <= high]
    if not asked and value > high:
        shifted = [f"{x:g}" for x in (value / 10, value / 100) if low <= x <= high]
        asked = [f"{' or '.join(shifted)} {unit}"] if shifted else []
    meant = f"; did you mean {' or '.join(asked)}?" if asked else ""
    return f"{value:g} {unit} is outside {low:,.9g} to {high:,.9g} {unit}{meant}"
