"""Triangle meshes from STL files, ASCII or binary."""

import struct
from pathlib import Path

import numpy as np

from dem.errors import MeshError
from dem.linear import length

WELD = 1e-6  # of the mesh's size: vertices this close are one


def read_stl(path, scale=1.0, closed=False):
    """Vertices (v, 3) [m] and triangles (t, 3) of an STL file.

    scale: metres per unit of the file; closed: demand that every edge has two triangles.
    Raises MeshError for a file that is not STL, not finite, has a triangle without area, or is open
    where it must not be.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MeshError(path, f"cannot be read ({error.strerror})") from None
    corners = _parse(path, data)
    if not len(corners):
        raise MeshError(path, "holds no triangles")
    if not np.isfinite(corners).all():
        raise MeshError(
            path, f"triangle {int(np.argwhere(~np.isfinite(corners))[0, 0]) + 1} is not finite"
        )
    vertices, triangles = _weld(corners * scale)
    _check_area(path, vertices, triangles)
    if closed:
        _check_closed(path, triangles)
    return vertices, triangles


def write_stl(path, vertices, triangles):
    """Write a binary STL file."""
    points = np.asarray(vertices, float)[np.asarray(triangles)]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normal /= length(normal)[:, None]
    record = np.zeros(len(points), dtype=[("v", "<f4", (4, 3)), ("a", "<u2")])
    record["v"][:, 0], record["v"][:, 1:] = normal, points
    with open(path, "wb") as stream:
        stream.write(b"triangle mesh".ljust(80))
        stream.write(struct.pack("<I", len(points)))
        stream.write(record.tobytes())


def _parse(path, data):
    if len(data) >= 84:
        count = struct.unpack_from("<I", data, 80)[0]
        if len(data) == 84 + 50 * count:
            record = np.frombuffer(data, dtype=[("v", "<f4", (4, 3)), ("a", "<u2")], offset=84)
            return record["v"][:, 1:].astype(float)
    if not data.lstrip().startswith(b"solid"):
        raise MeshError(
            path, "is not an STL file (neither 'solid' nor a whole number of binary triangles)"
        )
    numbers = []
    for number, line in enumerate(data.decode("ascii", "replace").splitlines(), 1):
        words = line.split()
        if words[:1] != ["vertex"]:
            continue
        try:
            numbers.append([float(w) for w in words[1:4]])
        except ValueError:
            raise MeshError(path, f"line {number}: not three numbers: {line.strip()!r}") from None
        if len(numbers[-1]) != 3:
            raise MeshError(path, f"line {number}: not three numbers: {line.strip()!r}")
    if len(numbers) % 3:
        raise MeshError(path, f"{len(numbers)} vertices do not make whole triangles")
    return np.array(numbers, float).reshape(-1, 3, 3)


def _weld(corners):
    points = corners.reshape(-1, 3)
    size = max(float(np.ptp(points, axis=0).max()), 1e-300)
    _, first, number = np.unique(
        np.round(points / (WELD * size)), axis=0, return_index=True, return_inverse=True
    )
    return points[first], number.reshape(-1, 3)


def _check_area(path, vertices, triangles):
    p = vertices[triangles]
    area = length(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
    size = float(np.ptp(vertices, axis=0).max())
    flat = np.flatnonzero(area < 1e-12 * size**2)
    if len(flat):
        raise MeshError(path, f"triangle {int(flat[0]) + 1} has no area")


def free_edges(triangles):
    """Edges (k, 2), as vertex numbers, that do not have two triangles."""
    edges = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1
    )
    edges, count = np.unique(edges, axis=0, return_counts=True)
    return edges[count != 2]


def _check_closed(path, triangles):
    free = free_edges(triangles)
    if len(free):
        raise MeshError(
            path,
            f"is not closed: {len(free)} edges do not have two triangles; grains "
            f"leak through a hole. "
            "geometry.meshes: open is for surfaces that are meant to have free edges",
        )
