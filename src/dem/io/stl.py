"""Triangle meshes from STL files, ASCII or binary.

A file is taken as the format has it or not at all: each facet with its three corners and an end,
numbers in ASCII digits. Python's `float` takes `1_0` for ten, and a facet without corners would be
a hole in a wall.
"""

import re
import struct
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError, MeshError, refused
from dem.linear import length
from dem.tables.limits import FARTHEST_MM, MOST_TRIANGLES, read_limited
from dem.units import NUMBER

WELD = 1e-6  # of the mesh's size: vertices this close are one
_POINT = rf"\s+({NUMBER})\s+({NUMBER})\s+({NUMBER})"
_VERTEX = rf"vertex{_POINT}", "vertex X Y Z, three numbers such as 1.5 or -2e-3"
_FACET = [
    (re.compile(pattern, re.ASCII), form)
    for pattern, form in (
        (rf"facet\s+normal{_POINT}", "facet normal X Y Z"),
        (r"outer\s+loop", "outer loop"),
        *3 * [_VERTEX],
        ("endloop", "endloop"),
        ("endfacet", "endfacet"),
    )
]
"""Lines of a facet, and how each is told."""
HEADER, RECORD = 84, 50
_BINARY = [("v", "<f4", (4, 3)), ("a", "<u2")]
SMALLEST_MM = 1e-6


def read_stl(
    path: str | Path, scale: float = 1.0, closed: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) [m] and triangles (t, 3) of an STL file.

    scale: metres per unit of the file; closed: demand that every edge has two triangles.
    Raises MeshError, with the line or the number of the triangle, for a file that is missing, too
    large or not as the format has it, for coordinates that are no place in a rig, for a triangle
    without area, and for a mesh that is open where it must not be.
    """
    try:
        corners = (_corners(Path(path)) * scale).reshape(-1, 3)
        cells = np.round(corners / (WELD * max(float(np.ptp(corners, axis=0).max()), 1e-300)))
        _, first, number = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        vertices, triangles = corners[first], number.reshape(-1, 3)
        a, b, c = np.moveaxis(vertices[triangles], 1, 0)
        size = float(np.ptp(vertices, axis=0).max())
        flat = np.flatnonzero(length(np.cross(b - a, c - a)) < 1e-12 * size**2)
        if len(flat):
            raise refused("no area", path=Path(path), number=int(flat[0]) + 1)
        free = free_edges(triangles) if closed else ()
        if len(free):
            raise refused("not closed", path=Path(path), edges=len(free))
    except InputError as error:
        raise MeshError(**vars(error)) from None
    return vertices, triangles


def write_stl(path: str | Path, vertices: ArrayLike, triangles: ArrayLike) -> None:
    """Write a binary STL file."""
    points = np.asarray(vertices, float)[np.asarray(triangles)]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normal /= length(normal)[:, None]
    record = np.zeros(len(points), dtype=_BINARY)
    record["v"][:, 0], record["v"][:, 1:] = normal, points
    with open(path, "wb") as stream:
        stream.write(b"triangle mesh".ljust(80))
        stream.write(struct.pack("<I", len(points)))
        stream.write(record.tobytes())


def _corners(path):
    """Corners (t, 3, 3) of the triangles, in units of the file."""
    data = read_limited(path, "mesh")
    count = struct.unpack_from("<I", data, HEADER - 4)[0] if len(data) >= HEADER else 0
    if count and len(data) == HEADER + RECORD * count:
        corners = np.frombuffer(data, _BINARY, offset=HEADER)["v"][:, 1:].astype(float)
        lines = None
    else:
        corners, lines = _from_text(path, data)
    _check_corners(path, corners.reshape(-1, 9), lines)
    return corners


def _from_text(path, data):
    """(corners (t, 3, 3), lines (t) of the facets) of an ASCII file."""
    text = data.decode("ascii") if data.isascii() else ""
    if not text.lstrip().startswith("solid"):
        raise refused("no stl", path=path)
    rows = [(n, row.strip()) for n, row in enumerate(text.splitlines(), 1) if row.strip()]
    corners, lines, at, inside = [], [], 0, False
    for line, row in rows:
        if at == 0 and row.split()[0] == ("endsolid" if inside else "solid"):
            inside = not inside
            continue
        pattern, form = _FACET[at] if inside else (None, "solid")
        match = pattern and pattern.fullmatch(row)
        if not match:
            form += " or endsolid" if at == 0 and inside else ""
            raise refused("no stl row", path=path, line=line, value=row, form=form)
        if at == 0:
            lines.append(line)
        elif match.groups():
            corners += [float(x) for x in match.groups()]
        at = (at + 1) % len(_FACET)
    if inside:
        line, row = rows[-1]
        raise refused("cut stl", path=path, line=line, value=row)
    return np.array(corners, float).reshape(-1, 3, 3), lines


def _check_corners(path, corners, lines):
    """corners (t, 9) in units of the file; lines (t) of the facets, None in a binary file."""
    if not len(corners):
        raise refused("no triangles", path=path)
    if len(corners) > MOST_TRIANGLES:
        raise refused("many triangles", path=path, value=len(corners), most=MOST_TRIANGLES)
    near = np.abs(corners) <= FARTHEST_MM  # nan is not
    wrong = np.flatnonzero(~near.all(axis=1))
    if len(wrong):
        k = wrong[0]
        which, line = (f"triangle {k + 1} ", None) if lines is None else ("", lines[k])
        far = float(corners[k][np.argmin(near[k])])
        raise refused("far corner", path=path, line=line, value=far, which=which, most=FARTHEST_MM)
    size = np.ptp(corners.reshape(-1, 3), axis=0).max()
    if size < SMALLEST_MM:
        raise refused("no size", path=path, value=f"{size:.3g} mm across", least=SMALLEST_MM)


def free_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges (k, 2), as vertex numbers, that do not have two triangles."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    return edges[count != 2]
