"""Spheres into pixels: an orthographic depth buffer in NumPy, with light, shadow and occlusion.

Written here rather than left to OpenGL, so that images come out the same on a cluster's node
without display, driver or Mesa. Rows of pixels run downwards; depth grows towards the viewer, in
pixels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter

LAMP = (-50.0, 55.0)  # azimuth from the viewer and elevation [deg]
AMBIENT, DIFFUSE, GLOSS = 0.45, 0.60, 0.10
SHADOW = 0.55  # share of the lamp's light that a shadow leaves
OCCLUSION = 0.35  # how much darker a deep gap is
NOBODY = -1  # owner of a pixel that no sphere covers


@dataclass(frozen=True)
class View:
    """Where the viewer stands: azimuth, elevation [deg]; scale [px/m]; `centre` (3,) [m] is in the
    middle of `width` x `height` pixels."""

    azimuth: float
    elevation: float
    scale: float
    centre: tuple
    width: int
    height: int

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors (3, 3): to the right, upwards, towards the viewer."""
        a, e = np.radians([self.azimuth, self.elevation])
        right = np.array([np.cos(a), np.sin(a), 0.0])
        toward = np.array([np.cos(e) * np.sin(a), -np.cos(e) * np.cos(a), np.sin(e)])
        return np.array([right, np.cross(toward, right), toward])

    def project(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Columns, rows and depths, each (n,) [px], of points (n, 3) [m]."""
        x, y, z = self.scale * self.axes @ (np.atleast_2d(position) - self.centre).T
        return 0.5 * self.width + x, 0.5 * self.height - y, z

    def points(self, depth: np.ndarray) -> np.ndarray:
        """Points (height, width, 3) [m] that lie at `depth` (height, width) behind each pixel."""
        row, column = np.mgrid[: self.height, : self.width]
        seen = np.stack([column - 0.5 * self.width, 0.5 * self.height - row, depth], axis=-1)
        return seen / self.scale @ self.axes + self.centre


def cover(view: View, position: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth (height, width) [px], -inf where there is nothing, and the index of the sphere that is
    seen. position (n, 3), radius (n,) [m]."""
    column, row, z = view.project(position)
    r = view.scale * np.asarray(radius)
    depth = np.full((view.height, view.width), -np.inf)
    owner = np.full(depth.shape, NOBODY)
    left, top = (np.maximum(np.ceil(c - r), 0).astype(int) for c in (column, row))
    right = np.minimum(np.floor(column + r), view.width - 1).astype(int) + 1
    bottom = np.minimum(np.floor(row + r), view.height - 1).astype(int) + 1
    columns, rows = np.arange(view.width), np.arange(view.height)[:, None]
    for k in np.flatnonzero((left < right) & (top < bottom)):
        patch = slice(top[k], bottom[k]), slice(left[k], right[k])
        across, down = columns[patch[1]] - column[k], rows[patch[0]] - row[k]
        under = r[k] ** 2 - across**2 - down**2
        front = np.where(under > 0.0, z[k] + np.sqrt(np.maximum(under, 0.0)), -np.inf)
        nearer = front > depth[patch]
        depth[patch][nearer] = front[nearer]
        owner[patch][nearer] = k
    return depth, owner


def shade(
    view: View,
    position: np.ndarray,
    radius: np.ndarray,
    colour: np.ndarray,
    plate_radius: float | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Lit spheres, and the disc z = 0 of `plate_radius` [m] where one is given.

    colour (n, 3) in 0..1. Returns colours (height, width, 3) and the covered share (height, width)
    of each pixel. position (n, 3), radius (n,) [m].
    """
    depth, owner = cover(view, position, radius)
    normal, albedo = np.zeros((*depth.shape, 3)), np.ones((*depth.shape, 3))
    hit = owner != NOBODY
    points = view.points(np.where(np.isfinite(depth), depth, 0.0))
    normal[hit] = (points[hit] - position[owner[hit]]) / radius[owner[hit], None]
    albedo[hit] = colour[owner[hit]]
    if plate_radius and view.elevation > 0.0:
        plate, depth, flat = _plate(view, depth, plate_radius)
        points[plate] = flat[plate]
        normal[plate], albedo[plate] = (0.0, 0.0, 1.0), 0.80
        hit = hit | plate
    # the lamp looks at the scene from over the viewer's shoulder
    side = int(1.5 * max(view.width, view.height))
    azimuth, elevation = view.azimuth + LAMP[0], LAMP[1]
    lamp = replace(view, azimuth=azimuth, elevation=elevation, width=side, height=side)
    direct = np.clip(normal @ lamp.axes[2], 0.0, None)
    ambient = AMBIENT
    if len(position):
        direct *= np.where(_shadowed(lamp, points, position, radius), SHADOW, 1.0)
        # 1 where a pixel lies in the open, less where its surroundings stand nearer to the viewer
        filled = np.where(hit, depth, depth[hit].min() if hit.any() else 0.0)
        reach = 1.5 * (view.scale * float(np.mean(radius)))
        around = gaussian_filter(filled, reach, truncate=2.0)
        ambient = AMBIENT * (1.0 - OCCLUSION * np.clip((around - filled) / reach, 0.0, 1.0))
    half = lamp.axes[2] + view.axes[2]
    gloss = GLOSS * np.clip(normal @ (half / np.linalg.norm(half)), 0.0, None) ** 30
    light = np.asarray(ambient + DIFFUSE * direct)[..., None]
    return np.clip(albedo * light + gloss[..., None], 0.0, 1.0), hit.astype(float)


def _plate(view, depth, plate_radius):
    """Pixels that show the plate, the depth with it, and the points [m] of its plane."""
    toward = view.axes[2]
    flat = view.points(np.zeros_like(depth))
    there = -flat[..., 2] / toward[2]
    flat += there[..., None] * toward
    plate = np.hypot(flat[..., 0], flat[..., 1]) < plate_radius
    plate &= view.scale * there > depth
    return plate, np.where(plate, view.scale * there, depth), flat


def _shadowed(lamp, points, position, radius):
    """Where (height, width) a sphere stands between the points and the lamp."""
    lit, _ = cover(lamp, position, radius)
    column, row, z = lamp.project(points.reshape(-1, 3))
    column, row = (np.clip(np.rint(c), 0, lamp.width - 1).astype(int) for c in (column, row))
    bias = 0.35 * lamp.scale * float(np.mean(radius))
    return (lit[row, column] > z + bias).reshape(points.shape[:2])
