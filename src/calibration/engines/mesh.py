"""Surfaces of revolution as triangles, for engines whose walls are meshes."""

import numpy as np

from dem.io.stl import write_stl

SIDES = 64
"""Sides of the polygons that stand for circles."""


def frustum(low_radius, low, high_radius, high):
    """Triangles [(3, 3)] of a cone's or cylinder's side between two heights [m], normals
    outwards."""
    a, b = _ring(low_radius, low), _ring(high_radius, high)
    after = np.roll(np.arange(SIDES), -1)
    out = []
    for k, m in enumerate(after):
        if low_radius > 0.0:
            out.append(np.array([a[k], a[m], b[m]]))
        if high_radius > 0.0:
            out.append(np.array([a[k], b[m], b[k]]))
    return out


def disc(radius, height=0.0):
    """Triangles of a flat disc; a ring between, so that none is very long."""
    half = 0.5 * radius
    return frustum(radius, height, half, height) + frustum(half, height, 0.0, height)


def _ring(radius, z):
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(SIDES, z)])


def write_mesh(path, triangles):
    """Write triangles [(3, 3)] as STL [m]; corners that coincide are one vertex."""
    corners = np.round(np.concatenate(triangles), 12)
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    write_stl(path, vertices, index.reshape(-1, 3))
