"""Names and units as a reader sees them."""

from dataclasses import dataclass

UNITS = {
    "_deg": "°",
    "_mm": " mm",
    "_kPa": " kPa",
    "_kg_m3": " kg/m³",
    "_m_s": " m/s",
    "_s": " s",
}
"""Suffix of a metric's name -> its unit as written behind a number."""


def label(name):
    """Readable form of a factor's name."""
    return name.replace("_", " ")


@dataclass(frozen=True)
class Quantity:
    """What a study calibrates, for labels: its name and its unit as written behind a number."""

    name: str
    unit: str

    @property
    def axis(self):
        """Label of an axis."""
        return f"{self.name}{self.brackets}"

    @property
    def brackets(self):
        """The unit in brackets, empty where there is none."""
        return f" [{self.unit.strip()}]" if self.unit else ""

    def value(self, x):
        """A value with its unit: two decimals of an angle, else four digits."""
        return f"{x:.2f}°" if self.unit == "°" else f"{x:.4g}{self.unit}"


def quantity_of(metric):
    """`Quantity` of a run's metric, whose name ends in its unit (angle_of_repose_deg)."""
    for suffix, unit in UNITS.items():
        if metric.endswith(suffix):
            return Quantity(label(metric.removesuffix(suffix)), unit)
    return Quantity(label(metric), "")


ANGLE = quantity_of("angle_of_repose_deg")
