"""Frames that ParaView opens: grains as points with radius, velocity and number; walls as surfaces.

The files are XML PolyData, arrays within them in base64, each in one block of zlib (VTK File
Formats, Kitware).
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dem.io.files import replace_file
from dem.linear import into_axes, length
from dem.walls.geometry import PLANE, RECTANGLE, REVOLVED, TRIANGLE

if TYPE_CHECKING:
    from dem.simulation import Simulation
    from dem.walls.builder import WallSet

RESOLUTION = 64  # facets of a surface of revolution
TYPES = {"f8": "Float64", "i8": "Int64"}


def write_grains(
    path: str | Path, position: ArrayLike, radius: ArrayLike, velocity: ArrayLike, tag: ArrayLike
) -> None:
    """Write grains to a .vtp file, atomically: position [m], velocity [m/s] (n, 3); radius [m] and
    tag (n,). Glyph by `radius` to see spheres."""
    velocity = np.asarray(velocity, float).reshape(-1, 3)
    fields = {"radius": np.asarray(radius, float), "velocity": velocity}
    fields |= {"speed": length(velocity), "id": np.asarray(tag, np.int64)}
    each = np.arange(len(velocity))[:, None]  # a vertex a grain
    _write(path, np.asarray(position, float).reshape(-1, 3), verts=list(each), fields=fields)


def write_frame(path: str | Path, sim: Simulation) -> None:
    """Write the grains of a simulation to a .vtp file, atomically."""
    write_grains(path, sim.position, sim.radius, sim.velocity, sim.tag)


def write_walls(path: str | Path, walls: WallSet, grains: np.ndarray | tuple[()] = ()) -> bool:
    """Write the walls of a `WallSet`, where they start, as `write_surfaces` does. grains (n, 3)
    [m]."""
    origins = {b["name"]: np.asarray(b["origin"], float) for b in walls.bodies}
    elements = [(k, p, origins[b], np.eye(3)) for k, p, b in walls.elements]
    return write_surfaces(path, elements, grains)


def write_surfaces(
    path: str | Path,
    elements: Iterable[tuple[int, Sequence[float] | np.ndarray, np.ndarray, np.ndarray]],
    grains: np.ndarray | tuple[()] = (),
) -> bool:
    """Write wall elements, each (kind, parameters, origin (3,), rotation (3, 3)) of its body, to
    one .vtp file; False when there is nothing to draw.

    A plane has no end: it is drawn as a square under the `grains` (n, 3) [m], without them not at
    all."""
    points, faces, count = [], [], 0
    for kind, parameters, origin, rotation in elements:
        if kind == PLANE:
            if not len(grains):
                continue
            inside = into_axes(rotation, np.asarray(grains) - origin)
            kind, parameters = RECTANGLE, _square(parameters, inside)
        corners, polygons = wall_surface(kind, parameters)
        points.append((corners[:, None, :] * rotation).sum(-1) + origin)
        faces += [polygon + count for polygon in polygons]
        count += len(corners)
    if not points:
        return False
    _write(path, np.concatenate(points), polys=faces)
    return True


def _square(plane, points):
    """Parameters of a rectangle in a plane, about points (n, 3) and as wide as they lie apart or
    above it."""
    at, normal = np.array(plane[:3]), np.array(plane[3:6])
    above = ((points - at) * normal).sum(-1)
    half = max(np.ptp(points, axis=0).max(), np.abs(above).max())
    middle = points.mean(axis=0)
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u *= half / length(u)
    centre = middle - ((middle - at) * normal).sum() * normal
    return [*centre, *u, *np.cross(normal, u)]


def wall_surface(kind: int, p: Sequence[float] | np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Corners (n, 3) [m] of a bounded wall element in its body's frame, and its polygons, each the
    numbers of its corners."""
    if kind == REVOLVED:
        turn, here = 2.0 * np.pi * np.arange(RESOLUTION) / RESOLUTION, np.arange(RESOLUTION)
        rings = [
            np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(RESOLUTION, z)])
            for r, z in (p[:2], p[2:4])
        ]
        after = (here + 1) % RESOLUTION
        quads = np.column_stack([here, after, after + RESOLUTION, here + RESOLUTION])
        return np.concatenate(rings), list(quads)
    if kind == RECTANGLE:
        c, u, v = np.array(p[:3]), np.array(p[3:6]), np.array(p[6:9])
        return np.array([c - u - v, c + u - v, c + u + v, c - u + v]), [np.arange(4)]
    assert kind == TRIANGLE
    return np.array(p, float).reshape(3, 3), [np.arange(3)]


def _write(path, points, verts=(), polys=(), fields=None):
    text = [
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor"><PolyData>',
        f'<Piece NumberOfPoints="{len(points)}" NumberOfVerts="{len(verts)}" '
        f'NumberOfPolys="{len(polys)}">',
        _section("PointData", fields or {}),
        _section("Points", {"Points": points}),
    ]
    for name, cells in (("Verts", verts), ("Polys", polys)):
        flat = np.concatenate(cells) if len(cells) else np.empty(0)
        ends = np.cumsum([len(cell) for cell in cells])
        cells = {"connectivity": flat.astype(np.int64), "offsets": ends.astype(np.int64)}
        text.append(_section(name, cells))
    text.append("</Piece></PolyData></VTKFile>")
    replace_file(path, lambda stream: stream.write("".join(text).encode()))


def _section(name, arrays):
    """Element with an array in each element below: header (blocks, bytes of a block, of the last if
    it is shorter, compressed bytes) and block in base64."""
    below = []
    for label, values in arrays.items():
        data = np.ascontiguousarray(values, values.dtype.newbyteorder("<")).tobytes()
        packed = zlib.compress(data, 1) if data else b""
        header = np.array([1, len(data), 0, len(packed)] if data else [0], "<u8")
        text = "".join(base64.b64encode(part).decode() for part in (header.tobytes(), packed))
        wide = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
        kind = TYPES[values.dtype.str[1:]]
        below.append(
            f'<DataArray type="{kind}" Name="{label}" format="binary"{wide}>{text}</DataArray>'
        )
    return f"<{name}>{''.join(below)}</{name}>" if below else f"<{name} />"
