"""A heap's angle and profile by two readers that share no line of code.

The first is the measure of this engine's heaps: lines along the flanks of silhouettes, and along
the mean surface. The second takes grains alone: a straight line along the envelope, the highest
grain in each ring about the axis, and the foot, the radius that holds most of the grains' volume. A
heap that is flat in its lower half and steep at the top has the same flanks as a cone by the first,
and another envelope.
"""

from __future__ import annotations

import numpy as np

from dem.errors import MeasureError
from dem.measure.heap import measure_heap

RING = 0.5
"""Width of a ring of the envelope, in mean diameters."""
FEWEST = 4
"""Rings that make a line."""
FOOT = 0.9
"""Share of the volume on the plate that lies within the foot."""
READERS = {
    "angle_of_repose_deg": "silhouettes",
    "radial_angle_deg": "mean surface",
    "height_mm": "highest grain",
    "on_plate": "grains on the plate",
    "envelope_angle_deg": "envelope",
    "envelope_height_mm": "envelope on the axis",
    "foot_mm": "foot",
}
"""Quantity of a profile -> what it is read from; the last three are the second reader's."""


def profile(
    position: np.ndarray, radius: np.ndarray, velocity: np.ndarray, plate_radius: float
) -> dict[str, float]:
    """{quantity of READERS: value} of a heap at rest: angles in degrees, lengths in mm.

    position, velocity (n, 3) [m], [m/s], radius (n,) [m], plate_radius [m]. Raises MeasureError
    where one of the readers finds no heap.
    """
    first = measure_heap(position, radius, velocity, plate_radius)
    axis = np.hypot(position[:, 0], position[:, 1])
    top = position[:, 2] + radius
    heap = (position[:, 2] > 0.0) & (axis < plate_radius) & (1e3 * top <= first["height_mm"])
    angle, height = envelope(axis[heap], top[heap], float(radius.mean()))
    second = {
        "envelope_angle_deg": angle,
        "envelope_height_mm": 1e3 * height,
        "foot_mm": 1e3 * foot(axis[heap], radius[heap]),
    }
    found = first | second
    return {name: float(found[name]) for name in READERS}


def envelope(axis: np.ndarray, top: np.ndarray, radius: float) -> tuple[float, float]:
    """(angle [deg], height on the axis [m]) of the straight line along the highest grain of each
    ring; the innermost, the rounded top, is left out.

    axis, top (n,): distance from the axis and upper end of each grain [m]; radius: mean [m]. Raises
    MeasureError where too few rings hold a grain."""
    ring = (axis / (RING * 2.0 * radius)).astype(int)
    highest = [np.flatnonzero(ring == k)[np.argmax(top[ring == k])] for k in np.unique(ring) if k]
    if len(highest) < FEWEST:
        raise MeasureError(f"no heap: grains in {len(highest)} rings about the axis")
    slope, height = np.polyfit(axis[highest], top[highest], 1)
    return float(np.degrees(np.arctan(-slope))), float(height)


def foot(axis: np.ndarray, radius: np.ndarray) -> float:
    """Distance from the axis [m] within which the share FOOT of the grains' volume lies. axis,
    radius (n,) [m]."""
    order = np.argsort(axis)
    held = np.cumsum(radius[order] ** 3)
    return float(axis[order][np.searchsorted(held, FOOT * held[-1])])
