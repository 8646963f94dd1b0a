"""A grain's closed mesh filled with spheres: `dem clump grain.stl` writes the table that a run
spec's `particles.clump` reads.

The inside is cut into cells. Each next sphere is the one inside the mesh, joined with those before,
that takes in most cells which none holds yet; its radius is the distance to the surface
(scipy.ndimage's distance transform).
"""

from pathlib import Path

import numpy as np
import pandas as pd
from scipy import ndimage
from scipy.spatial import cKDTree

from calibration.files import write_table
from calibration.intake.tables import refused
from dem.grains.clump import MAX_RATIO, MAX_SPHERES, fault, shape_of
from dem.io.grain_tables import COLUMNS
from dem.io.stl import read_stl

CELLS = 96  # along the longest side of the mesh
MOST_TRIED = 4000  # places for a sphere's centre


def fill_mesh(path: str | Path, number: int, out: str | Path | None = None) -> list[str]:
    """Fill an STL file [mm] with at most `number` spheres; returns sentences for the screen.

    out: table to write, `<name>.csv` beside the file unless given. Raises ConfigError for a number
    that a clump cannot have, a table that exists, and a mesh that cannot be used or leaks.
    """
    path = Path(path)
    out = Path(out) if out else path.with_suffix(".csv")
    if not 1 <= number <= MAX_SPHERES:
        raise refused("spheres", f"--spheres {number}", most=MAX_SPHERES)
    if out.exists():
        raise refused("mesh exists", out)
    vertices, triangles = read_stl(path, closed=True)
    inside, origin, pitch = cells_inside(vertices, triangles)
    centre, radius, held = spheres_in(inside, number)
    centre, radius = origin + pitch * centre, pitch * radius
    spheres = [(*c, r) for c, r in zip(centre.tolist(), radius.tolist(), strict=True)]
    if wrong := fault(spheres):
        raise refused("bad sphere", path, sphere=wrong[1], limits=wrong[2])
    write_table(pd.DataFrame(spheres, columns=list(COLUMNS)).round(6), out)
    volume = mesh_volume(vertices, triangles)
    return [
        f"{out}: {len(radius)} spheres, {2 * radius.min():.3g} to {2 * radius.max():.3g} mm, fill "
        f"{100 * held.sum() / inside.sum():.1f} % of the grain's {volume:.4g} mm3",
        f"its moments of inertia, at the same volume: {_inertia(inside, shape_of(tuple(spheres)))}",
        f"particles: {{ clump: {{ file: {out} }}, diameter_mm: "
        f"{(6.0 * volume / np.pi) ** (1.0 / 3.0):.4g} }} # the grain's volume",
    ]


def mesh_volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Volume of a closed mesh (divergence theorem), in the vertices' unit cubed."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return abs(float((a * np.cross(b, c)).sum())) / 6.0


def cells_inside(
    vertices: np.ndarray, triangles: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Which cells of a grid have their middle inside a closed mesh (nx, ny, nz), the middle of the
    first cell (3,) and the cells' side, in the vertices' unit.

    A line along z through a cell's middle is inside after an odd number of triangles. The grid is
    shifted by shares of a cell that no mesh has, so that no line meets an edge.
    """
    low, high = vertices.min(0), vertices.max(0)
    pitch = float((high - low).max()) / CELLS
    origin = low + pitch * (np.array([0.41421356, 0.23606798, 0.5]) - 1.0)
    shape = np.ceil((high - origin) / pitch).astype(int) + 2
    crossed = np.zeros(shape, bool)
    for corners in (vertices[triangles] - origin) / pitch:
        i, j, z = _crossings(corners)
        np.logical_xor.at(crossed, (i, j, np.ceil(z).astype(int)), True)
    return np.logical_xor.accumulate(crossed, axis=2), origin, pitch


def _crossings(corners):
    """Lines (i, j) along z that a triangle (3, 3) meets, and where (z), all in cells."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    x = np.arange(np.ceil(corners[:, 0].min()), np.floor(corners[:, 0].max()) + 1)
    y = np.arange(np.ceil(corners[:, 1].min()), np.floor(corners[:, 1].max()) + 1)
    if area == 0.0 or not len(x) or not len(y):
        return np.zeros(0, int), np.zeros(0, int), np.zeros(0)
    x, y = np.meshgrid(x, y, indexing="ij")
    second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
    third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
    met = (second >= 0.0) & (third >= 0.0) & (second + third <= 1.0)
    z = az + second * (bz - az) + third * (cz - az)
    return x[met].astype(int), y[met].astype(int), z[met]


def spheres_in(inside: np.ndarray, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres (m, 3) and radii (m,) of at most `number` spheres inside the cells (nx, ny, nz), in
    cells, and which of them (k,) the spheres hold. Fewer where the mesh is full."""
    depth = ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1, 1:-1] - 0.5
    ridge = inside & (depth >= ndimage.maximum_filter(depth, size=3) - 0.5)
    place = np.argwhere(ridge)
    place = place[np.argsort(depth[ridge], kind="stable")[::-1][:MOST_TRIED]]
    reach = depth[tuple(place.T)]
    reach, place = reach[keep := reach >= reach.max() / MAX_RATIO], place[keep]
    cells = np.argwhere(inside)
    free = np.ones(len(cells), bool)
    chosen: list[int] = []
    while len(chosen) < number and free.any():
        gained = cKDTree(cells[free]).query_ball_point(place, reach, return_length=True)
        if chosen:
            gained[~_joined(place, reach, place[chosen], reach[chosen])] = 0
        best = int(np.argmax(gained))
        if gained[best] <= 1:
            break
        chosen.append(best)
        free &= ((cells - place[best]) ** 2).sum(1) > reach[best] ** 2
    return place[chosen].astype(float), reach[chosen], ~free


def _joined(place, reach, centre, radius):
    """Which spheres overlap with one of the chosen."""
    apart = np.sqrt(((place[:, None] - centre[None, :]) ** 2).sum(2))
    return (apart < reach[:, None] + radius[None, :]).any(1)


def _inertia(inside, shape):
    """The principal moments of a clump over those of the cells inside the mesh, at one volume."""
    cells = np.argwhere(inside).astype(float)
    cells -= cells.mean(0)
    cells /= (3.0 * len(cells) / (4.0 * np.pi)) ** (1.0 / 3.0)  # volume of a sphere of radius 1
    square = 4.0 / 3.0 * np.pi * (cells.T @ cells) / len(cells)
    mesh = np.linalg.eigvalsh(np.trace(square) * np.eye(3) - square)
    ratios = np.linalg.eigvalsh(shape.inertia) / mesh
    return ", ".join(f"{ratio:.2f}" for ratio in ratios) + " of the mesh's"
