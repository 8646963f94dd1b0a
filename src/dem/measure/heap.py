"""Angle of repose of a heap of spheres on a disc, in the two ways that are in use.

Silhouette: the heap is seen from the side, as a protractor would; a line is laid along each flank
of its outline. Radial surface: the height of the surface at each radius, averaged over the azimuth,
and one line along its flank. Both lines are least-squares fits over the part of the flank between
20 and 80 % of the heap's height: the rounded top and the toe, where single grains lie about, are
left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import MeasureError
from dem.linear import length, slope

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.simulation import Simulation

VIEWS = 36
AZIMUTHS = 120
SECTORS = 12
LOWER, UPPER = 0.2, 0.8
FLYING = 0.15  # grains faster than this [m/s] are not part of the heap
MIN_POINTS = 4
APART_DEG = 3.0
"""Between the two readings of one heap, beyond which it has no one angle: a cone of grains gives
both alike to half a degree (docs/verification.md), a ridge or a heap off the axis does not."""
MIN_HEIGHT = 1.5  # mean diameters of the spheres: less is a layer, not a heap
LOST_BELOW = 0.2  # radii of the plate; grains this far below it have run off


def measure_heap(
    position: ArrayLike,
    radius: ArrayLike,
    velocity: ArrayLike,
    plate_radius: float,
    grain: np.ndarray | None = None,
) -> dict[str, Any]:
    """Metrics of a heap; position, velocity (n, 3) [m], [m/s], radius (n,) [m], plate_radius [m].

    grain (n,): which grain each sphere is part of; each is one unless given. Angles and height are
    those of the surface of the spheres.
    Raises MeasureError when no heap stands on the plate.
    """
    position, radius, velocity = (np.asarray(a, float) for a in (position, radius, velocity))
    on_plate = heap_grains(position, radius, velocity, plate_radius)
    p, r = position[on_plate], radius[on_plate]
    count = len(p) if grain is None else len(np.unique(grain[on_plate]))
    if count < 20:
        raise MeasureError(f"no heap: {count} grains lie on the plate")
    height = float((p[:, 2] + r).max())
    if height < MIN_HEIGHT * 2.0 * float(np.mean(r)):
        raise MeasureError(f"no heap: the grains on the plate stand {1e3 * height:.2f} mm high")
    flanks = silhouette_angles(p, r, plate_radius)
    # the surface over each of SECTORS sectors, and averaged over the azimuth
    stations, seen = surface(p, r, plate_radius)
    limit = plate_radius - float(np.mean(r))  # beyond, grains hang over the rim
    sectors = seen.reshape(SECTORS, -1, len(stations)).mean(axis=1)
    radial = _valid([fit_flank(stations, s, limit) for s in sectors], "radial surface")
    angle = fit_flank(stations, seen.mean(axis=0), limit)
    if not np.isfinite(angle):
        raise MeasureError("no heap: the radial surface has no flank")
    return {
        "angle_of_repose_deg": float(np.mean(flanks)),
        "angle_of_repose_sd_deg": float(np.std(flanks, ddof=1)),
        "radial_angle_deg": angle,
        "radial_angle_sd_deg": float(np.std(radial, ddof=1)),
        "height_mm": 1e3 * height,
        "on_plate": count,
    }


def heap_grains(
    position: np.ndarray, radius: np.ndarray, velocity: np.ndarray, plate_radius: float
) -> np.ndarray:
    """Grains (n,) bool that belong to the heap. position (n, 3), radius (n,), plate_radius [m],
    velocity (n, 3) [m/s]."""
    slow = length(velocity) < FLYING
    on_plate = slow & (np.hypot(position[:, 0], position[:, 1]) < plate_radius + radius)
    on_plate &= position[:, 2] > 0.0
    return on_plate & _supported(position, radius, on_plate)


def standing(sim: Simulation, plate_radius: float, rim: float = 0.0) -> dict[str, Any]:
    """`measure_heap` of the grains of a simulation above a plate whose rim is as high, both [m]."""
    where = sim.position - [0.0, 0.0, rim]
    return measure_heap(where, sim.radius, sim.velocity, plate_radius, sim.grain)


def read_at_rest(
    sim: Simulation, context: RunContext, plate_radius: float, rim: float = 0.0
) -> tuple[dict[str, Any], float]:
    """Metrics as `standing` gives them, and `coverage`; the context notes where the heap has no one
    angle."""
    found = standing(sim, plate_radius, rim)
    if apart := readings_apart(found):
        context.notes.append(apart)
    return found, coverage(sim.position - [0.0, 0.0, rim], sim.radius, plate_radius)


def slopes_of(heap: Mapping[str, float]) -> tuple[float, float]:
    """Both angles [deg] of a heap whose metrics are given."""
    return heap["angle_of_repose_deg"], heap["radial_angle_deg"]


def take_lost(sim: Simulation, height: float) -> int:
    """Take out grains that have fallen below a height [m]; returns their number."""
    lost = sim.particles.position[: sim.n, 2] < height
    return sim.remove(sim.particles.tag[: sim.n][lost])


def readings_apart(metrics: Mapping[str, float]) -> str | None:
    """A sentence where the two readings of a heap, keys of `measure_heap`, differ by more than
    APART_DEG; None where they agree."""
    flanks, radial = slopes_of(metrics)
    if abs(flanks - radial) <= APART_DEG:
        return None
    return (
        f"the heap has no one angle: its silhouettes give {flanks:.1f} degrees and its mean "
        f"surface {radial:.1f}; it is a ridge, stands off the axis, is cut off or has two slopes"
    )


def _supported(position, radius, candidate):
    """Leave out what hangs above the heap (grains in the funnel): a gap in height larger than four
    grains ends the heap."""
    order = np.flatnonzero(candidate)
    order = order[np.argsort(position[order, 2])]
    z = position[order, 2]
    gaps = np.flatnonzero(np.diff(z) > 8.0 * float(np.max(radius, initial=0.0)))
    keep = np.zeros(len(position), bool)
    keep[order[: gaps[0] + 1] if len(gaps) else order] = True
    return keep


def fit_flank(distance: np.ndarray, height: np.ndarray, limit: float) -> float:
    """Slope angle [deg] of the flank of a profile height(distance), both (m,) [m], or nan where
    there is no flank.

    The flank begins at the last place above 80 % of the height and ends at the first below 20 %,
    within `limit`."""
    top = float(np.nanmax(height))
    inside = distance <= limit
    above = np.flatnonzero(inside & (height > UPPER * top))
    begin = above[-1] + 1 if len(above) else 0
    below = np.flatnonzero(inside & (height < LOWER * top) & (np.arange(len(height)) >= begin))
    end = below[0] if len(below) else int(inside.sum())
    if end - begin < MIN_POINTS:
        return np.nan
    rise = slope(distance[begin:end], height[begin:end])
    return float(np.degrees(np.arctan(-rise)))


def outline(
    across: np.ndarray, z: np.ndarray, radius: np.ndarray, stations: np.ndarray
) -> np.ndarray:
    """Height (m,) of the outline of discs at `across`, z, radius (n,), at stations (m,); 0 where
    there is none. [m]"""
    height = np.zeros(len(stations))
    step = stations[1] - stations[0]
    near = across + radius >= stations[0]  # the others lie on the far side of the axis
    across, z, radius = across[near], z[near], radius[near]
    first = np.ceil((across - radius - stations[0]) / step).astype(int)
    last = np.floor((across + radius - stations[0]) / step).astype(int)
    for shift in range(int((last - first).max(initial=0)) + 1):
        k = first + shift
        ok = (k <= last) & (k >= 0) & (k < len(stations))
        under = radius[ok] ** 2 - (across[ok] - stations[k[ok]]) ** 2
        np.maximum.at(height, k[ok], z[ok] + np.sqrt(np.maximum(under, 0.0)))
    return height


def silhouette_angles(position: np.ndarray, radius: np.ndarray, plate_radius: float) -> np.ndarray:
    """Flank angles (2 * VIEWS,) [deg], two from each view. Raises MeasureError when fewer than half
    have a flank. position (n, 3), radius (n,), plate_radius [m]."""
    step = 0.25 * float(np.mean(radius))
    stations = np.arange(0.0, plate_radius, step)
    angles = []
    for turn in np.arange(VIEWS) * np.pi / VIEWS:
        across = position[:, 0] * np.cos(turn) + position[:, 1] * np.sin(turn)
        for side in (1.0, -1.0):
            profile = outline(side * across, position[:, 2], radius, stations)
            angles.append(fit_flank(stations, profile, plate_radius - float(np.mean(radius))))
    return _valid(angles, "silhouette")


def surface(
    position: np.ndarray, radius: np.ndarray, plate_radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Stations (m,) and surface heights (AZIMUTHS, m) on rays from the axis [m]. position (n, 3),
    radius (n,), plate_radius [m]."""
    step = 0.5 * float(np.mean(radius))
    stations = np.arange(0.5 * step, plate_radius, step)
    height = np.zeros((AZIMUTHS, len(stations)))
    for k, turn in enumerate(2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS):
        along = position[:, 0] * np.cos(turn) + position[:, 1] * np.sin(turn)
        aside = -position[:, 0] * np.sin(turn) + position[:, 1] * np.cos(turn)
        hit = np.abs(aside) < radius
        cut = np.sqrt(radius[hit] ** 2 - aside[hit] ** 2)
        height[k] = outline(along[hit], position[hit, 2], cut, stations)
    return stations, height


def coverage(position: np.ndarray, radius: np.ndarray, plate_radius: float) -> float:
    """Share of the plate that lies under grains whose centre is above it and at most four radii
    high or in the heap.

    From the surface on `AZIMUTHS` rays, each station weighted by its distance from the axis.
    position (n, 3), radius (n,), plate_radius [m].
    """
    low = (position[:, 2] > 0.0) & _supported(position, radius, position[:, 2] > 0.0)
    stations, height = surface(position[low], radius[low], plate_radius)
    return float(((height > 0.0) * stations).sum() / (AZIMUTHS * stations.sum()))


def _valid(angles, what):
    angles = np.array(angles)
    good = angles[np.isfinite(angles)]
    if len(good) < max(len(angles) // 2, 2):
        short = f"{len(angles) - len(good)} of {len(angles)} flanks of the {what} are too short"
        raise MeasureError(f"no heap: {short}")
    return good
