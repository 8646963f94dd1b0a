"""A grain of several spheres that overlap and move as one body: what its union weighs and how it
turns.

Volume, centre and inertia are those of the union, an overlap counted once. The union is cut by
parallel lines; along each line its pieces are known exactly, so that only their number limits the
result: volume and moments are right to 4e-5 (`tests/unit/test_clump.py`). Sums, products and roots
alone take part, in a fixed order, so that every machine finds the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from dem.linear import length

MAX_SPHERES = 10
MAX_RATIO = 10.0  # of the largest radius to the smallest, which sets the time step
LEAST_MM, MOST_MM = 1e-6, 1e6  # of lengths in a table
LINES = 400  # along each side of the box around the union
TOUCH = 1e-9  # of the sum of the radii: centres this much further apart still touch


class Shape(NamedTuple):
    """A grain with the volume of a sphere of radius 1, its centre of mass in the origin."""

    offset: np.ndarray
    """(m, 3) centres of the spheres."""
    radius: np.ndarray
    """(m,)."""
    inertia: np.ndarray
    """(3, 3) about the centre of mass, at density 1."""
    scale: float
    """Radius of a sphere with the volume of the spheres as they were given."""

    @property
    def smallest(self) -> float:
        """Radius of the smallest sphere."""
        return float(self.radius.min())

    @property
    def reach(self) -> float:
        """Distance of the furthest point from the centre of mass."""
        return float((length(self.offset) + self.radius).max())


def fault(spheres: Sequence[tuple[float, float, float, float]]) -> tuple[int, Any, str] | None:
    """Return what is wrong with spheres [(x, y, z, radius)] [mm]: (index, value, what is allowed);
    None where nothing is."""
    if len(spheres) > MAX_SPHERES:
        return MAX_SPHERES, f"{len(spheres)} spheres", f"1 to {MAX_SPHERES} spheres"
    return _wrong_size(spheres) or _wrong_place(spheres)


def _wrong_size(spheres):
    largest = max(s[3] for s in spheres)
    for k, (*centre, radius) in enumerate(spheres):
        if radius <= 0.0:
            return k, radius, "a radius above 0"
        if not max(LEAST_MM, largest / MAX_RATIO) <= radius <= MOST_MM:
            limits = f"{LEAST_MM:g} to {MOST_MM:g} mm"
            return k, radius, f"a radius of {limits} and 1/{MAX_RATIO:g} of the largest at least"
        far = max(centre, key=abs)
        if abs(far) > MOST_MM:
            return k, far, f"a centre within {MOST_MM:g} mm"
    return None


def _wrong_place(spheres):
    centre, radius = _arrays(spheres)
    apart = length(centre[:, None] - centre[None, :])
    for k in range(len(spheres)):
        holds = apart[k] + radius[k] <= radius
        holds[k:] &= radius[k:] > radius[k]  # of two equal spheres the second is one too many
        if holds.any():
            other = int(np.argmax(holds)) + 1
            allowed = f"a sphere that is not inside another; this one is in sphere {other}"
            return k, spheres[k], allowed
    joined = _joined(apart <= (1.0 + TOUCH) * (radius[:, None] + radius[None, :]))
    if not joined.all():
        k = int(np.argmin(joined))
        return k, spheres[k], "spheres that touch or overlap; the first one is not joined with this"
    return None


def _arrays(spheres):
    table = np.array(spheres, float)
    return table[:, :3], table[:, 3]


def _joined(touching):
    """(m,) bool: which spheres the first one is joined with, across others too."""
    found = touching[0].copy()
    for _ in touching:
        found |= (touching & found[:, None]).any(axis=0)
    return found


@lru_cache
def shape_of(spheres: tuple[tuple[float, float, float, float], ...]) -> Shape:
    """`Shape` of spheres ((x, y, z, radius), ...) in any unit of length."""
    centre, radius = _arrays(spheres)
    if len(radius) == 1:  # the sphere itself, to the bit
        inertia = 0.4 * 4.0 / 3.0 * math.pi * np.eye(3)
        return Shape(np.zeros((1, 3)), np.ones(1), inertia, float(radius[0]))
    volume, middle, inertia = union(centre, radius)
    scale = (volume / (4.0 / 3.0 * math.pi)) ** (1.0 / 3.0)
    return Shape((centre - middle) / scale, radius / scale, inertia / scale**5, scale)


def union(centre: np.ndarray, radius: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centre of mass (3,) and inertia (3, 3) about it, at density 1, of the union of
    spheres: centre (m, 3), radius (m,)."""
    low, high = (centre - radius[:, None]).min(0), (centre + radius[:, None]).max(0)
    origin, pitch = 0.5 * (low + high), (high - low)[:2] / LINES
    line = (np.arange(LINES) + 0.5)[:, None] * pitch + (low - origin)[:2]
    x, y = line[:, 0][:, None], line[:, 1][None, :]
    cut = pitch[0] * pitch[1] * _pieces(centre - origin, radius, x, y)  # of z^0, z^1, z^2
    volume = float(cut[0].sum())
    first = np.array([(x * cut[0]).sum(), (y * cut[0]).sum(), cut[1].sum()]) / volume
    square = np.empty((3, 3))
    square[0, 0], square[1, 1] = (x * x * cut[0]).sum(), (y * y * cut[0]).sum()
    square[2, 2], square[0, 1] = cut[2].sum(), (x * y * cut[0]).sum()
    square[0, 2], square[1, 2] = (x * cut[1]).sum(), (y * cut[1]).sum()
    for a, b in ((0, 1), (0, 2), (1, 2)):
        square[b, a] = square[a, b]
    square -= volume * first[:, None] * first[None, :]
    trace = square[0, 0] + square[1, 1] + square[2, 2]
    return volume, origin + first, trace * np.eye(3) - square


def _pieces(centre, radius, x, y):
    """Integrals (3, a, b) of 1, z and z^2 over what the union has in common with the lines along z
    at x (a, 1), y (1, b)."""
    square = [
        r * r - (x - c[0]) ** 2 - (y - c[1]) ** 2 for c, r in zip(centre, radius, strict=True)
    ]
    half = np.sqrt(np.maximum(np.array(square), 0.0))
    low, high = centre[:, 2][:, None, None] - half, centre[:, 2][:, None, None] + half
    order = np.argsort(low, axis=0, kind="stable")
    low, high = (np.take_along_axis(v, order, 0) for v in (low, high))
    out, top = np.zeros((3, *low.shape[1:])), np.full(low.shape[1:], -np.inf)
    for begin, end in zip(low, high, strict=True):
        begin, end = np.maximum(begin, top), np.maximum(end, top)  # below top all is counted
        out[0] += end - begin
        out[1] += 0.5 * (end * end - begin * begin)
        out[2] += (end * end * end - begin * begin * begin) / 3.0
        top = end
    return out


def random_turns(count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 3, 3) rotations, all orientations equally likely: unit quaternions evenly over their
    sphere."""
    q = rng.normal(size=(count, 4))
    w, x, y, z = (q / np.sqrt((q * q).sum(1))[:, None]).T
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def turned(turn: np.ndarray, shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (k, m, 3) and inertias (k, 3, 3) of a `Shape` after rotations turn (k, 3, 3)."""
    offset = (turn[:, None] * shape.offset[None, :, None, :]).sum(-1)
    half = (turn[:, :, :, None] * shape.inertia[None, None]).sum(2)
    return offset, (half[:, :, None, :] * turn[:, None]).sum(-1)
