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

from dem.errors import InputError, MeshError
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
    path = Path(path)
    vertices, triangles = _weld(_corners(path) * scale)
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    size = float(np.ptp(vertices, axis=0).max())
    flat = np.flatnonzero(length(np.cross(b - a, c - a)) < 1e-12 * size**2)
    if len(flat):
        raise MeshError(path, f"triangle {int(flat[0]) + 1} has no area")
    free = free_edges(triangles) if closed else ()
    if len(free):
        raise MeshError(
            path,
            f"is not closed: {len(free)} edges do not have two triangles; grains leak through a "
            "hole. geometry.meshes: open is for surfaces that are meant to have free edges",
        )
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
    try:
        data = read_limited(path, "mesh")
    except InputError as error:
        facts = {k: v for k, v in vars(error).items() if k not in ("path", "reason")}
        raise MeshError(path, error.reason, **facts) from None
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
        raise MeshError(
            path, "is no STL file, or one that was cut off",
            allowed="text that begins with solid, or 50 bytes for each triangle that its head "
            "names, after 84",
        )  # fmt: skip
    rows = [(n, row.strip()) for n, row in enumerate(text.splitlines(), 1) if row.strip()]
    corners, lines, at, inside = [], [], 0, False
    for line, row in rows:
        if at == 0 and row.split()[0] == ("endsolid" if inside else "solid"):
            inside = not inside
            continue
        pattern, form = _FACET[at] if inside else (None, "solid")
        match = pattern and pattern.fullmatch(row)
        if not match:
            allowed = f"{form} or endsolid" if at == 0 and inside else form
            raise MeshError(path, "is not as an STL file has it", line=line, value=row,
                            allowed=allowed)  # fmt: skip
        if at == 0:
            lines.append(line)
        elif match.groups():
            corners += [float(x) for x in match.groups()]
        at = (at + 1) % len(_FACET)
    if inside:
        line, row = rows[-1]
        raise MeshError(path, "ends before its end", line=line, value=row,
                        allowed="endsolid as the last line")  # fmt: skip
    return np.array(corners, float).reshape(-1, 3, 3), lines


def _check_corners(path, corners, lines):
    """corners (t, 9) in units of the file; lines (t) of the facets, None in a binary file."""
    if not len(corners):
        raise MeshError(path, "holds no triangles", allowed="one or more")
    if len(corners) > MOST_TRIANGLES:
        raise MeshError(path, "has too many triangles", value=len(corners),
                        allowed=f"at most {MOST_TRIANGLES:,}")  # fmt: skip
    near = np.abs(corners) <= FARTHEST_MM  # nan is not
    wrong = np.flatnonzero(~near.all(axis=1))
    if len(wrong):
        k = wrong[0]
        which = f"triangle {k + 1} " if lines is None else ""
        raise MeshError(
            path, f"{which}has a corner that is no place in a rig",
            line=None if lines is None else lines[k], value=float(corners[k][np.argmin(near[k])]),
            allowed=f"coordinates of at most {FARTHEST_MM:g} mm",
        )  # fmt: skip
    size = np.ptp(corners.reshape(-1, 3), axis=0).max()
    if size < SMALLEST_MM:
        raise MeshError(path, "has no size", value=f"{size:.3g} mm across",
                        allowed=f"{SMALLEST_MM:g} mm or more; lengths are mm")  # fmt: skip


def _weld(corners):
    points = corners.reshape(-1, 3)
    cell = WELD * max(float(np.ptp(points, axis=0).max()), 1e-300)
    cells = np.round(points / cell)
    _, first, number = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    return points[first], number.reshape(-1, 3)


def free_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges (k, 2), as vertex numbers, that do not have two triangles."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    return edges[count != 2]
