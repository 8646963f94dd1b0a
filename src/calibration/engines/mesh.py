"""Walls as triangles, for engines whose walls are meshes."""

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from dem.io.stl import write_stl
from dem.io.vtk import wall_surface
from dem.walls.builder import WallSet
from dem.walls.geometry import REVOLVED

SIDES = 64
"""Sides of the polygons that stand for circles."""
LONGEST = 15.0
"""Length of a triangle over its width at the most: LIGGGHTS takes no needles."""
HEADER_END = 79
"""Last byte of a binary STL file's header."""


def frustum(low_radius: float, low: float, high_radius: float, high: float) -> list[np.ndarray]:
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


def disc(radius: float, height: float = 0.0) -> list[np.ndarray]:
    """Triangles of a flat disc; a ring between, so that none is very long. radius, height: [m]."""
    half = 0.5 * radius
    return frustum(radius, height, half, height) + frustum(half, height, 0.0, height)


def body(walls: WallSet, name: str) -> list[np.ndarray]:
    """Triangles of a body of a `WallSet` where it starts. They are [(3, 3)] in m."""
    origin = next(b["origin"] for b in walls.bodies if b["name"] == name)
    out = []
    for kind, numbers, owner in walls.elements:
        if owner == name:
            if kind == REVOLVED:
                out += _revolved(*numbers[:4])
                continue
            corners, polygons = wall_surface(kind, numbers)
            out += [corners[[p[0], p[k], p[k + 1]]] for p in polygons for k in range(1, len(p) - 1)]
    return [np.asarray(triangle) + origin for triangle in out]


def _revolved(r0, z0, r1, z1):
    """A segment turned about z, in bands that are not much longer than wide."""
    width = 2.0 * np.pi * max(r0, r1) / SIDES
    bands = max(math.ceil(math.hypot(r1 - r0, z1 - z0) / (LONGEST * width)), 1)
    cuts = np.column_stack([np.linspace(r0, r1, bands + 1), np.linspace(z0, z1, bands + 1)])
    return [t for low, high in pairwise(cuts) for t in frustum(*low, *high)]


def _ring(radius, z):
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(SIDES, z)])


def write_mesh(path: str | Path, triangles: Sequence[np.ndarray]) -> None:
    """Write triangles [(3, 3)] as STL [m]; corners that coincide are one vertex.

    The header ends a line. LIGGGHTS reads the first line of a mesh as text before it takes the file
    as binary, and fails where the bytes up to there hold an odd number of quotes
    (input_mesh_tri.cpp, `parse_nonlammps`).
    """
    corners = np.round(np.concatenate(triangles), 12)
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    write_stl(path, vertices, index.reshape(-1, 3))
    with open(path, "r+b") as stream:
        stream.seek(HEADER_END)
        stream.write(b"\n")
