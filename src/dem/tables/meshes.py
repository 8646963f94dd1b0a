"""Whether an STL file is one, line by line, before it is read: numbers as the format has them, each
facet with its three corners, and an end.

The reader itself (`dem.io.stl`) takes the corners alone. Python's `float` takes `1_0` for ten, and
a facet without corners would be a hole in a wall.
"""

import re
import struct
from pathlib import Path

import numpy as np

from dem.errors import InputError
from dem.tables.limits import FARTHEST_MM, MOST_TRIANGLES, read_limited

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_POINT = rf"\s+({NUMBER})\s+({NUMBER})\s+({NUMBER})"
_LINES = {
    "facet": re.compile(rf"facet\s+normal{_POINT}", re.ASCII),
    "outer": re.compile(r"outer\s+loop", re.ASCII),
    "vertex": re.compile(rf"vertex{_POINT}", re.ASCII),
    "endloop": re.compile("endloop"),
    "endfacet": re.compile("endfacet"),
}
_FACET = ("facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet")
_FORMS = {
    "facet": "facet normal X Y Z",
    "outer": "outer loop",
    "vertex": "vertex X Y Z, three numbers such as 1.5 or -2e-3",
}
HEADER, RECORD = 84, 50
SMALLEST_MM = 1e-6


def check_mesh(path: str | Path) -> None:
    """Raise InputError naming the line or the triangle of an STL file that is not as the format
    has it, or is no grain, funnel or plate."""
    data = read_limited(path, "mesh")
    count = struct.unpack_from("<I", data, HEADER - 4)[0] if len(data) >= HEADER else 0
    if count and len(data) == HEADER + RECORD * count:
        record = np.frombuffer(data, [("v", "<f4", (4, 3)), ("a", "<u2")], offset=HEADER)
        corners = record["v"][:, 1:].astype(float)
        places = [("triangle", n) for n in range(1, count + 1)]
    else:
        corners, places = _corners(path, data)
    _check_corners(path, corners.reshape(-1, 9), places)


def check_meshes_of(spec) -> None:
    """The same of each mesh that the geometry of a `RunSpec` names, with its key."""
    for key, name in spec.geometry.model_dump(mode="json").items():
        if key.endswith("_stl") and name is not None:
            try:
                check_mesh(name)
            except InputError as error:
                raise InputError(**vars(error) | {"key": f"geometry.{key}"}) from None


def _check_corners(path, corners, places):
    """corners (n, 9) [mm]; places (n): ("line" or "triangle", number)."""
    if len(corners) > MOST_TRIANGLES:
        raise InputError("has too many triangles", path=path, value=len(corners),
                         allowed=f"at most {MOST_TRIANGLES:,}")  # fmt: skip
    wrong = np.flatnonzero(~(np.abs(corners) <= FARTHEST_MM).all(axis=1))
    if len(wrong):
        kind, number = places[wrong[0]]
        where = {"line": number} if kind == "line" else {}
        said = "" if where else f"triangle {number} "
        raise InputError(
            f"{said}has a corner that is no place in a rig", path=path, **where,
            value=float(corners[wrong[0]][np.argmax(~(np.abs(corners[wrong[0]]) <= FARTHEST_MM))]),
            allowed=f"coordinates of at most {FARTHEST_MM:g} mm",
        )  # fmt: skip
    size = np.ptp(corners.reshape(-1, 3), axis=0).max() if len(corners) else 0.0
    if len(corners) and size < SMALLEST_MM:
        raise InputError("has no size", path=path, value=f"{size:.3g} mm across",
                         allowed=f"{SMALLEST_MM:g} mm or more; lengths are mm")  # fmt: skip


def _corners(path, data):
    """(corners (n, 9), places (n)) of an ASCII file."""
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError:
        text = ""
    if not text.lstrip().startswith("solid"):
        raise InputError(
            "is no STL file, or one that was cut off", path=path,
            allowed="text that begins with solid, or 50 bytes for each triangle that its head "
            "names, after 84",
        )  # fmt: skip
    lines = [(n, line.strip()) for n, line in enumerate(text.splitlines(), 1) if line.strip()]
    corners, places, at, inside = [], [], 0, False
    for number, line in lines:
        word = line.split()[0]
        if at == 0 and word == ("endsolid" if inside else "solid"):
            inside = not inside
            continue
        expected = _FACET[at]
        match = _LINES[expected].fullmatch(line) if inside else None
        if not match:
            allowed = _FORMS.get(expected, expected)
            allowed += " or endsolid" if at == 0 and inside else ""
            raise InputError("is not as an STL file has it", path=path, line=number, value=line,
                             allowed=allowed if inside else "solid")  # fmt: skip
        if expected == "facet":
            places.append(("line", number))
        if expected == "vertex":
            corners += [float(x) for x in match.groups()]
        at = (at + 1) % len(_FACET)
    if inside:
        raise InputError("ends before its end", path=path, line=lines[-1][0], value=lines[-1][1],
                         allowed="endsolid as the last line")  # fmt: skip
    return np.array(corners, float), places
