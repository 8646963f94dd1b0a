"""The quantities that are measured and the levers that are set: their units, limits, words and place in a run spec."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """What an experiment measures: its column's text, unit, limits, and the words for a sentence."""

    name: str
    unit: str
    least: float
    most: float
    words: str
    relative: bool
    """Whether its spread goes with its value; that of an angle does not."""


@dataclass(frozen=True)
class Lever:
    """What is set: limits, words and unit for a sentence, the experiments that have it and its place in a run spec.

    place: (part, key); None where it belongs to the measurement and not to the simulated model.
    """

    least: float
    most: float
    words: str
    unit: str
    experiments: tuple
    place: tuple | None


QUANTITIES = {
    "heap": Quantity("angle_of_repose", "deg", 0.1, 89.0, "angle of repose", False),
    "drop": Quantity("rebound_height", "mm", 1e-3, 1e4, "rebound", True),
    "tilt": Quantity("sliding_angle", "deg", 0.1, 89.0, "sliding angle", False),
    "shear": Quantity("shear_stress", "kPa", 1e-4, 1e4, "shear stress", True),
}
"""Experiment -> what it measures."""

_ALL = tuple(QUANTITIES)
LEVERS = {
    "particle_diameter_mm": Lever(
        1e-3, 100.0, "grain diameter", "mm", _ALL, ("particles", "diameter_mm")
    ),
    "particle_count": Lever(
        1.0, 5e6, "number of grains", "", ("heap", "shear"), ("particles", "count")
    ),
    "discharge_height_mm": Lever(
        1.0, 1e4, "discharge height", "mm", ("heap",), ("geometry", "discharge_height_mm")
    ),
    "drop_height_mm": Lever(
        1.0, 1e4, "drop height", "mm", ("drop",), ("geometry", "drop_height_mm")
    ),
    "tilt_rate_deg_s": Lever(
        1e-3, 90.0, "tilt rate", "°/s", ("tilt",), ("geometry", "tilt_rate_deg_s")
    ),
    "normal_stress_kPa": Lever(
        1e-3, 1e4, "normal stress", "kPa", ("shear",), ("geometry", "normal_stress_kPa")
    ),
    "scale_factor": Lever(0.01, 100.0, "scale factor", "", _ALL, ("particles", "scale_factor")),
    "output_interval_s": Lever(1e-6, 10.0, "frame interval", "s", ("drop",), None),
}
"""Lever column -> what it is."""
