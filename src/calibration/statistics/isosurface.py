"""The surface in a cube on which a function has one value, as triangles."""

from collections.abc import Callable

import numpy as np

STEPS = 3
STEP = 1e-4
"""Of the slope's differences, in coded levels."""


def isosurface(
    function: Callable[[np.ndarray], np.ndarray], level: float, resolution: int = 41
) -> tuple[np.ndarray, np.ndarray]:
    """(vertices (n, 3), triangles (m, 3)) of the points of the cube [-1, 1]^3 where a function of
    points (n, 3) has the value `level`; both empty where there are none.

    Surface nets (Gibson 1998, MICCAI, 888-898): each cell of a grid that the surface crosses has
    one vertex, and the four cells around an edge that it crosses share two triangles. The vertices
    are then moved onto the surface along its slope. The outermost cells are centred on the cube's
    faces, and their vertices are kept in the cube.
    """
    half = 1.0 / (resolution - 1)
    line = np.linspace(-1.0 - half, 1.0 + half, resolution + 1)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1)
    above = function(grid.reshape(-1, 3)).reshape(grid.shape[:3]) > level
    corners = sum(above[_shifted(s)].astype(int) for s in np.ndindex(2, 2, 2))
    cells = np.argwhere((corners > 0) & (corners < 8))
    number = np.full(corners.shape, -1)
    number[tuple(cells.T)] = np.arange(len(cells))
    vertices = _onto(function, level, line[cells] + half)
    return vertices, np.concatenate([_triangles(above, number, axis) for axis in range(3)])


def _shifted(shift):
    """The corner of every cell that lies `shift` (0 or 1 an axis) from its first."""
    return tuple(slice(s, None if s else -1) for s in shift)


def _onto(function, level, points):
    """Points moved to where the function has the level, by Newton's steps along its slope; on a
    face of the cube along the face."""
    ends = STEP * np.eye(3)
    for _ in range(STEPS if len(points) else 0):
        points = np.clip(points, -1.0, 1.0)
        rise = [(function(points + e) - function(points - e)) / (2.0 * STEP) for e in ends]
        slope = np.stack(rise, axis=1)
        off = (function(points) - level)[:, None]
        outward = (np.abs(points) == 1.0) & (points * off * slope < 0.0)
        slope[outward] = 0.0
        steep = (slope**2).sum(1, keepdims=True)
        points = points - np.divide(off * slope, steep, out=np.zeros_like(slope), where=steep > 0.0)
    return np.clip(points, -1.0, 1.0)


def _triangles(above, number, axis):
    """Two triangles for each inner edge along `axis` whose ends lie on two sides of the surface."""
    first, second = (np.moveaxis(above, axis, 0)[s] for s in (slice(None, -1), slice(1, None)))
    crossed = (first != second)[:, 1:-1, 1:-1]
    i, j, k = np.nonzero(crossed)
    cells = np.moveaxis(number, axis, 0)
    a, b, c, d = cells[i, j, k], cells[i, j + 1, k], cells[i, j + 1, k + 1], cells[i, j, k + 1]
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
