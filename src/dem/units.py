"""Units at the border: `1.35 g/cm3` under a key that ends in a unit, and the question a doubtful
value gets back.

A key carries its unit as its ending (`density_kg_m3`). A value may carry its own; it is then
converted. A bare number
is in the key's unit and must be plausible there: a slip of the unit moves it by powers of ten.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

UNITS = {
    "_kg_m3": "kg/m³",
    "_J_m3": "J/m³",
    "_J_m2": "J/m²",
    "_mm_s": "mm/s",
    "_deg_s": "°/s",
    "_rad_s": "rad/s",
    "_per_s": "1/s",
    "_m_s": "m/s",
    "_kg_s": "kg/s",
    "_g_s": "g/s",
    "_N_m": "N/m",
    "_Pa_s": "Pa·s",
    "_kPa": "kPa",
    "_Pa": "Pa",
    "_mm": "mm",
    "_deg": "°",
    "_N": "N",
    "_s": "s",
    "_kg": "kg",
}
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
        return [
            _entry(v, f"{place}.{n}" if isinstance(v, dict) else place, key)
            for n, v in enumerate(value)
        ]
    unit = unit_of(key)
    if unit is None or not has_unit(value):
        return value
    try:
        return in_unit(value, unit)
    except UnitError as error:
        error.key, error.value = place, value
        raise


@cache
def _registry():
    import pint  # takes half a second, which a study without units need not wait for

    return pint.UnitRegistry()


def _convert(number, own, unit):
    import pint

    if not _SPELLED.fullmatch(own):
        raise UnitError(f"{own!r} is no unit; allowed: {unit} or another unit of its kind")
    registry = _registry()
    try:
        quantity = number * registry.parse_units(_spelled(own))
        # rounded to the digits of a decimal number: 1.35 g/cm3 is 1350 kg/m3, not
        # 1350.0000000000002
        return float(f"{quantity.to(_spelled(unit)).magnitude:.15g}")
    except pint.DimensionalityError:
        raise UnitError(
            f"{own} is of another kind; allowed: {unit}, or what converts to it"
        ) from None
    except (
        Exception
    ):  # the library's parser raises errors of a dozen kinds for a text that is no unit
        raise UnitError(
            f"{own!r} is no known unit; allowed: {unit} or another unit of its kind"
        ) from None


def _spelled(unit):
    """A unit as the library reads it: powers by `**`, products by `*`."""
    text = unit.translate(_ON_THE_LINE).replace("·", "*").replace("^", "").replace('"', "inch")
    return _POWER.sub(r"**\1", text)


@dataclass(frozen=True)
class Band:
    """Plausible values of a key, and the units that are written there by mistake."""

    low: float
    high: float
    slips: tuple


_LENGTHS = ("m", "cm", "µm")
BANDS = (
    (re.compile(r"density_kg_m3$"), Band(5.0, 25_000.0, ("g/cm³",))),
    (re.compile(r"modulus_Pa$"), Band(1e4, 1e12, ("kPa", "MPa", "GPa"))),
    (re.compile(r"(^|\.)diameters?_mm$"), Band(0.01, 300.0, _LENGTHS)),
    (re.compile(r"(orifice|plate|top|inner|outer)_diameter_mm$"), Band(0.5, 2e4, _LENGTHS)),
    (re.compile(r"(discharge|drop)_height_mm$"), Band(0.5, 2e4, _LENGTHS)),
    (re.compile(r"plate_(length|width)_mm$"), Band(0.5, 2e4, _LENGTHS)),
    (re.compile(r"(^|\.)height_mm$"), Band(0.1, 2e4, _LENGTHS)),
    (re.compile(r"rebound_height_mm$"), Band(0.05, 2e4, _LENGTHS)),
    (re.compile(r"funnel_half_angle_deg$"), Band(3.0, 89.9, ("rad",))),
    (re.compile(r"(repose|radial_angle)_deg$"), Band(3.0, 89.0, ("rad",))),
    (re.compile(r"sliding_angle_deg$"), Band(1.5, 89.0, ("rad",))),
    (re.compile(r"stress_kPa$"), Band(1e-3, 1e4, ("Pa", "MPa"))),
)
"""(key, band): values outside are asked about. The bands hold every grain from silt to boulders."""


def question(key: str, value: object) -> str | None:
    """The question that a bare number gets back which no material or rig has, else None.

    Of the units written by mistake it names those under which the number would be plausible.
    """
    band = next((b for pattern, b in BANDS if pattern.search(key)), None)
    if band is None or not isinstance(value, int | float) or isinstance(value, bool) or value <= 0:
        return None
    if band.low <= value <= band.high:
        return None
    unit = unit_of(key)
    guesses = [(slip, _convert(value, slip, unit)) for slip in band.slips]
    fitting = [
        f"{value:g} {slip} ({x:.4g} {unit})" for slip, x in guesses if band.low <= x <= band.high
    ]
    shifted = [x for x in (value / 10, value / 100) if band.low <= x <= band.high]
    if fitting:
        asked = f"; did you mean {' or '.join(fitting)}?"
    elif shifted and value > band.high:
        asked = f"; did you mean {' or '.join(f'{x:g}' for x in shifted)} {unit}?"
    else:
        asked = ""
    return f"{value:g} {unit} is outside {band.low:,.9g} to {band.high:,.9g} {unit}{asked}"
