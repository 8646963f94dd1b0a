"""Meshes that a rig's geometry names in place of its own walls: read, measured, and refused where
grains would leak or where the mesh is not what the other keys say. Lengths in SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError, MeshError
from dem.flow import LOOSE
from dem.grains.sizes import grain_volume, smallest_radius
from dem.io.stl import free_edges, read_stl

if TYPE_CHECKING:
    from pathlib import Path

    from dem.spec import RunSpec
    from dem.walls.builder import WallSet


MayEnd = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Choice of the free edges that a mesh may have: (ends (k, 2, 3), vertices) -> (k,) bool."""

AGREES = 0.05
"""Share by which a mesh's size may differ from the key that tells it; a circle of 10 sides is 4.9 %
narrower over its flats."""

SLACK = 0.05  # of the smallest grain's radius: surfaces this close to their place are in place
ROUND = 1e-6  # of an edge: what the single precision of a STL file comes to, and more
TURNS = 720  # directions in which a section is measured
LEVELS = 25  # sections of a vessel or tube
RAYS = 97  # on which a ring is measured, a prime number
GRID = 25  # points along a side at which a plate is measured


def read_mesh(spec: RunSpec, key: str, may_end: MayEnd | None = None) -> Mesh | None:
    """`Mesh` that geometry.`key` names [mm in the file]; None where it names none.

    may_end: which free edges the mesh may have, as at the rim of a vessel of no thickness; none
    unless given. Raises MeshError for a mesh that cannot be read and for one that leaks.
    """
    path = getattr(spec.geometry, key)
    if path is None:
        return None
    mesh = Mesh(spec, path, *read_stl(path, 1e-3))
    edges = free_edges(mesh.triangles)
    if may_end is not None:
        edges = edges[~may_end(mesh.vertices[edges], mesh.vertices)]
    if len(edges):
        x, y, z = 1e3 * mesh.vertices[edges[0]].mean(axis=0)
        first = f"{len(edges)}, the first of them at ({x:.4g}, {y:.4g}, {z:.4g}) mm"
        mesh.refuse(f"leaks: edges without two triangles: {first}; close the mesh there")
    return mesh


def check_meshes_of(spec: RunSpec) -> None:
    """Raise InputError, with the key, for a mesh that the geometry of a `RunSpec` names and that
    cannot be read."""
    for key, name in spec.geometry.model_dump(mode="json").items():
        if key.endswith("_stl") and name is not None:
            try:
                read_stl(name)
            except MeshError as error:
                raise InputError(**vars(error) | {"key": f"geometry.{key}"}) from None


class Mesh:
    """A mesh with its measures; vertices (v, 3) [m], triangles (t, 3) vertex numbers, `low` and
    `high`: its least and greatest height [m]."""

    def __init__(
        self, spec: RunSpec, path: str | Path, vertices: np.ndarray, triangles: np.ndarray
    ) -> None:
        self.spec, self.path = spec, path
        self.vertices, self.triangles = self.body = vertices, triangles
        self.low, self.high = float(vertices[:, 2].min()), float(vertices[:, 2].max())
        self.slack = SLACK * smallest_radius(spec)

    def heights(self, points: np.ndarray) -> np.ndarray:
        """Heights (n, t) [m] at which the vertical through each of points (n, 2) meets each
        triangle; nan where it does not."""
        a, b, c = np.moveaxis(self.vertices[self.triangles], 1, 0)
        ab, ac = b - a, c - a
        area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
        flat = np.abs(area) > 1e-12 * np.ptp(self.vertices, axis=0).max() ** 2
        area = np.where(flat, area, np.nan)  # a vertical triangle is an edge from above
        x, y = (points[:, None, k] - a[None, :, k] for k in (0, 1))
        v = (x * ac[:, 1] - y * ac[:, 0]) / area
        w = (y * ab[:, 0] - x * ab[:, 1]) / area
        inside = (v > -ROUND) & (w > -ROUND) & (v + w < 1.0 + ROUND)
        return np.where(inside, a[:, 2] + v * ab[:, 2] + w * ac[:, 2], np.nan)

    def around(self, height: float) -> tuple[np.ndarray, float]:
        """Distance (TURNS,) [m] from the z axis to the mesh in all directions at a height, and the
        least one there is. Raises MeshError where a direction meets nothing."""
        # ends (k, 2) of the lines in which the plane at the height cuts the mesh
        p = self.vertices[self.triangles]
        above = p[:, :, 2] > height
        cut = above.any(axis=1) & ~above.all(axis=1)
        p, above = p[cut], above[cut]
        odd = above == (above.sum(axis=1) == 1)[:, None]  # the corner alone on its side
        first = np.argmax(odd, axis=1)
        each = np.arange(len(p))
        alone = p[each, first]
        ends = []
        for step in (1, 2):
            other = p[each, (first + step) % 3]
            share = (height - alone[:, 2]) / (other[:, 2] - alone[:, 2])
            ends.append(alone[:, :2] + share[:, None] * (other - alone)[:, :2])
        a, b = ends
        turn = 2.0 * math.pi * (np.arange(TURNS)[:, None] + 0.5) / TURNS
        ux, uy, e = np.cos(turn), np.sin(turn), b - a
        with np.errstate(divide="ignore", invalid="ignore"):
            across = ux * e[:, 1] - uy * e[:, 0]
            reach = (a[:, 0] * e[:, 1] - a[:, 1] * e[:, 0]) / across
            share = (a[:, 0] * uy - a[:, 1] * ux) / across
            met = (reach > 0.0) & (share > -ROUND) & (share < 1.0 + ROUND)
            near = np.clip(-(a * e).sum(axis=1) / (e * e).sum(axis=1), 0.0, 1.0)
        found = np.where(met, reach, np.inf).min(axis=1, initial=np.inf)
        if not np.isfinite(found).all():
            self.refuse(f"is open at z = {1e3 * height:.4g} mm: it does not go round the z axis")
        closest = a + np.nan_to_num(near)[:, None] * e
        return found, float(np.hypot(*closest.T).min())

    def volume(self, level: float) -> float:
        """Volume [m3] around the z axis that it encloses from z = 0 to a level."""
        middle = level * (np.arange(LEVELS) + 0.5) / LEVELS
        areas = [float((self.around(z)[0] ** 2).mean()) * math.pi for z in middle]
        return level * float(np.mean(areas))

    def narrowest(self, low: float, high: float) -> float:
        """Least distance [m] of the mesh from the z axis between two heights, read at LEVELS."""
        middle = low + (high - low) * (np.arange(LEVELS) + 0.5) / LEVELS
        return min(self.around(z)[1] for z in middle)

    def take(self, spec: RunSpec) -> None:
        """Refuse a vessel that does not take the spec's grains, loosely poured, below its rim."""
        share = LOOSE * self.volume(self.high) / (spec.particles.count * grain_volume(spec))
        if share < 1.0:
            most = int(share * spec.particles.count)
            self.refuse(f"is too small: loosely poured, it takes {most} grains below its rim")

    def extended(self, walls: WallSet, top: float) -> WallSet:
        """Add the mesh to the last body of a `WallSet`, with a cylinder from its rim up to `top`
        [m], within which grains are made. Returns the set."""
        walls.mesh(*self.body)
        if top > self.high:
            walls.cylinder(self.around((1.0 - 1e-6) * self.high)[1], self.high, top)
        return walls

    def four_sided(self, what: str, height: float, half_x: float, half_y: float) -> None:
        """Refuse a mesh that is no rectangle of these half widths [m] about the z axis at a
        height."""
        turn = 2.0 * math.pi * (np.arange(TURNS) + 0.5) / TURNS
        out = self.around(height)[0]
        x, y = np.abs(out * np.cos(turn)), np.abs(out * np.sin(turn))
        wrong = np.argmax(np.abs(np.maximum(x - half_x, y - half_y)))
        if abs(max(x[wrong] - half_x, y[wrong] - half_y)) > self.slack:
            found = f"{what} reaches to x = {1e3 * x[wrong]:.4g}, y = {1e3 * y[wrong]:.4g} mm"
            allowed = f"sides at {1e3 * half_x:.4g} and {1e3 * half_y:.4g} mm"
            self.refuse(f"{found} at z = {1e3 * height:.4g} mm; allowed: {allowed}")

    def agree(self, what: str, found: float, key: str) -> None:
        """Refuse a length `found` [m] that is not what geometry.`key` says [mm]."""
        given = getattr(self.spec.geometry, key)
        if abs(1e3 * found - given) > AGREES * given:
            allowed = f"geometry.{key}, {given:g} mm, within {AGREES:.0%}"
            self.refuse(f"{what} is {1e3 * found:.4g} mm; allowed: {allowed}")

    def in_place(self, what: str, heights: ArrayLike, wanted: float) -> None:
        """Refuse a surface of which not all heights, (n,) or one [m], are `wanted`."""
        heights = np.atleast_1d(heights)
        wrong = heights[np.argmax(np.abs(heights - wanted))]
        if abs(wrong - wanted) > self.slack:
            allowed = f"{1e3 * wanted:.4g} mm, within {1e3 * self.slack:.2g} mm"
            self.refuse(f"{what} lies at z = {1e3 * wrong:.4g} mm; allowed: {allowed}")

    def covering(
        self, points: np.ndarray, what: str, side: float = 1.0, below: float = np.inf
    ) -> np.ndarray:
        """Heights (n,) [m] of the mesh from above (side 1) or below (-1) over points (n, 2), of
        what lies below a height [m]. Refuses a mesh that does not cover them."""
        heights = self.heights(points)
        found = np.where(heights < below, side * heights, -np.inf).max(axis=1)
        if not np.isfinite(found).all():
            x, y = 1e3 * points[np.argmin(found)]
            self.refuse(f"is too small or lies elsewhere: {what} misses ({x:.4g}, {y:.4g}) mm")
        return side * found

    def topped(self, low: np.ndarray, high: np.ndarray, what: str, side: float = 1.0) -> np.ndarray:
        """Heights (GRID * GRID,) [m] of `covering` over the rectangle low..high, both (2,). Refuses
        a mesh of which the highest point (side 1) or the lowest (-1) over it is not at z = 0.

        The mesh is made of triangles, so that this point is over a corner of the rectangle or on an
        edge, at an end of what lies over the rectangle.
        """
        surface = self.covering(rectangle(low, high), what, side)
        tip = side * float((side * np.append(surface, self._ridges(low, high))).max())
        self.in_place(f"its {'highest' if side > 0.0 else 'lowest'} point", tip, 0.0)
        return surface

    def _ridges(self, low, high):
        """Heights (2, k) [m] of the ends of the mesh's edges, each cut to the rectangle
        low..high."""
        ends = self.vertices[self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)]
        start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            cuts = np.stack([(border - start[:, :2]) / along[:, :2] for border in (low, high)])
        for cut, far in zip(cuts, (-np.inf, np.inf), strict=True):
            cut[np.isnan(cut)] = far  # an edge along a border
        cuts.sort(axis=0)  # shares of the edge at which it enters and leaves
        enter = cuts[0].max(axis=1).clip(min=0.0)
        leave = cuts[1].min(axis=1).clip(max=1.0)
        met = enter <= leave
        return start[met, 2] + np.stack([enter, leave])[:, met] * along[met, 2]

    def refuse(self, reason: str) -> None:
        """Raise MeshError."""
        raise MeshError(reason, path=self.path)


def rectangle(low: Sequence[float] | np.ndarray, high: Sequence[float] | np.ndarray) -> np.ndarray:
    """Points (k, 2) of a grid over the rectangle low..high, both (2,)."""
    lines = [np.linspace(a, b, GRID) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)


def circle(radius: float) -> np.ndarray:
    """Points (k, 2) of a grid within a circle."""
    points = rectangle((-radius, -radius), (radius, radius))
    return points[np.hypot(*points.T) <= radius]


def annulus(inner: float, outer: float) -> np.ndarray:
    """Points (k, 2) between two circles, on rays from the axis, of which few meet evenly turned
    vanes."""
    turn = 2.0 * math.pi * (np.arange(RAYS) + 0.5) / RAYS
    out = np.linspace(inner, outer, GRID)[:, None]
    return np.stack([out * np.cos(turn), out * np.sin(turn)], axis=-1).reshape(-1, 2)


def at_rims(low: bool = False) -> MayEnd:
    """`may_end` of vessels: at the upper rim, and with `low` at the lower one too."""

    def may_end(ends, vertices):
        z, near = ends[:, :, 2], ROUND * np.ptp(vertices[:, 2])
        upper, lower = z > vertices[:, 2].max() - near, z < vertices[:, 2].min() + near
        return upper.all(axis=1) | (low & lower.all(axis=1))

    return may_end


def outside(low: ArrayLike, high: ArrayLike) -> MayEnd:
    """`may_end` of plates: outside the rectangle low..high, both (2,) [m], in which grains are."""

    def may_end(ends, vertices):
        xy, near = ends[:, :, :2], ROUND * np.ptp(vertices[:, :2])
        before, after = xy < np.asarray(low) + near, xy > np.asarray(high) - near
        return (before.all(axis=1) | after.all(axis=1)).any(axis=1)

    return may_end
