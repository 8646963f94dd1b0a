"""The lines that the angle of repose was read from, as segments that can be drawn over the
silhouette."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dem.measure.heap import FLYING, LOWER, UPPER, _supported, fit_flank, outline


@dataclass(frozen=True)
class Flank:
    """A fitted flank: its angle [deg] and its ends (2,) [m], distance from the axis (signed) and
    height."""

    angle_deg: float
    begin: tuple
    end: tuple


def heap_grains(
    position: np.ndarray, radius: np.ndarray, velocity: np.ndarray, plate_radius: float
) -> np.ndarray:
    """Which grains (n,) belong to the heap, as the measurement takes them. position (n, 3), radius
    (n,) [m], velocity (n, 3) [m/s]."""
    slow = np.linalg.norm(velocity, axis=1) < FLYING
    on_plate = slow & (np.hypot(position[:, 0], position[:, 1]) < plate_radius + radius)
    on_plate &= position[:, 2] > 0.0
    return on_plate & _supported(position, radius, on_plate)


def fitted_flanks(
    position: np.ndarray, radius: np.ndarray, plate_radius: float, azimuth: float
) -> list[Flank | None]:
    """The flanks left and right, each a `Flank` or None, of the silhouette seen at `azimuth` [deg].

    Both angles are `dem.measure.heap.fit_flank`'s; the line runs through the mean of the points it
    was fitted to. position (n, 3), radius (n,) [m].
    """
    turn = np.radians(azimuth)
    across = position[:, 0] * np.cos(turn) + position[:, 1] * np.sin(turn)
    stations = np.arange(0.0, plate_radius, 0.25 * float(np.mean(radius)))
    limit = plate_radius - float(np.mean(radius))
    found = []
    for side in (-1.0, 1.0):
        profile = outline(side * across, position[:, 2], radius, stations)
        found.append(_segment(stations, profile, limit, side))
    return found


def _segment(distance, height, limit, side):
    angle = fit_flank(distance, height, limit)
    if not np.isfinite(angle):
        return None
    top, slope = float(height.max()), -np.tan(np.radians(angle))
    flank = (distance <= limit) & (height <= UPPER * top) & (height >= LOWER * top)
    flank &= distance > distance[(distance <= limit) & (height > UPPER * top)].max(initial=0.0)
    x, y = float(distance[flank].mean()), float(height[flank].mean())
    ends = [(side * (x + (level - y) / slope), level) for level in (1.05 * top, 0.0)]
    return Flank(angle, *ends)
