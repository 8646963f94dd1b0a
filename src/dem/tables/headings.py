"""A heading and the unit behind it, as people write them: `angle [deg]`, `Winkel in °`,
`Masse / g`."""

import re
from collections.abc import Iterable

UNITS = {
    "°", "deg", "rad", "grad", "m", "cm", "mm", "µm", "μm", "um", "g", "kg", "mg", "t", "s", "ms",
    "min", "h", "%", "N", "kN", "mN", "Pa", "kPa", "MPa", "GPa", "bar", "mbar", "g/s", "kg/s",
    "kg/h", "g/min", "t/h", "g/cm³", "g/cm3", "kg/m³", "kg/m3", "g/l", "kg/l", "g/ml", "g/mL",
    "mm/s", "m/s", "N/m", "N/m²", "N/m2", "1/s", "g/cm^3", "kg/m^3",
}  # fmt: skip
"""What counts as a unit without brackets about it."""
SPELLED = {
    "Grad": "deg", "degree": "deg", "degrees": "deg", "degré": "deg", "degrés": "deg",
    "Degré": "deg", "Degrés": "deg", "Sekunden": "s", "secondes": "s", "seconds": "s",
    "Prozent": "%", "percent": "%", "pourcent": "%", "Millimeter": "mm", "millimètres": "mm",
}  # fmt: skip
"""Units in words. `Grad` with a capital is the German degree, `grad` may be a gon."""
_BEHIND = re.compile(r"(.*\S)(?:\s+in\s+|\s+en\s+|\s*,\s+|\s+/\s+)(\S{1,12})")
_BEGINS_AS_NUMBER = re.compile(r"[+-]?[.,]?\d")


def parted(cell: str) -> tuple[str, str]:
    """(name, unit) of a heading; the unit is empty where none stands behind the name."""
    cell = cell.strip()
    opening = max(cell.rfind("["), cell.rfind("("))
    if cell.endswith(("]", ")")) and opening >= 0:
        unit = cell[opening + 1 : -1].strip()
        return (cell[:opening].strip() or cell), SPELLED.get(unit, unit)
    match = _BEHIND.fullmatch(cell) if len(cell) <= 200 else None
    if match and (match[2] in UNITS or match[2] in SPELLED):
        return match[1], SPELLED.get(match[2], match[2])
    return cell, ""


def words_alone(cells: Iterable[str]) -> bool:
    """Return whether no cell is a number or begins as one does."""
    return not any(_BEGINS_AS_NUMBER.match(c) for c in cells)
