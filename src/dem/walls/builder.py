"""Walls as Python sees them: named rigid bodies made of planes, surfaces of revolution, rectangles
and meshes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from dem.linear import length
from dem.walls.geometry import N_PARAMETERS, PLANE, RECTANGLE, REVOLVED, TRIANGLE
from dem.walls.state import new_walls

if TYPE_CHECKING:
    from dem.walls.state import Walls


RIGHT = 1e-6  # cosine of the angle between a rectangle's edges


class WallSet:
    """A collection of wall bodies, each with a name, a material and a motion. All lengths in m.

    Elements are given in the frame of their body, whose origin is `origin` and which starts
    unrotated.
    """

    def __init__(self) -> None:
        self.bodies = []  # type: list[dict[str, Any]]
        self._elements = []  # type: list[tuple[int, Any, int, float]]

    def body(
        self,
        name: str,
        *,
        material: str,
        origin: Sequence[float] = (0.0, 0.0, 0.0),
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        spin: Sequence[float] = (0.0, 0.0, 0.0),
        free: Mapping[str, Any] | None = None,
    ) -> WallSet:
        """Begin a new body; elements added next belong to it. Returns self.

        velocity [m/s] of the origin, spin [rad/s] about it. free: dict with mass [kg], axis (3,),
        load [N] along the axis and optionally drag [N s/m]: the body then moves along the axis by
        its load, its weight and the particles. Raises ValueError for a name that is taken.
        """
        if any(b["name"] == name for b in self.bodies):
            raise ValueError(f"there is already a wall body named {name!r}")
        moves = {"origin": origin, "velocity": velocity, "spin": spin, "free": free}
        self.bodies.append({"name": name, "material": material} | moves)
        return self

    def _add(self, kind, numbers, extent=0.0):
        self._elements.append((kind, numbers, len(self.bodies) - 1, extent))
        return self

    def plane(self, point: Sequence[float], normal: ArrayLike) -> WallSet:
        """Half space behind an unbounded plane; `normal` points to the free side. point (3,) [m];
        normal (3,) of any length. Raises ValueError for a normal of zero."""
        normal = np.asarray(normal, float)
        if not length(normal) > 0.0:
            raise ValueError("a plane's normal must not be zero")
        return self._add(PLANE, [*point, *(normal / length(normal))])

    def revolved(self, r0: float, z0: float, r1: float, z1: float) -> WallSet:
        """The segment (r0, z0)-(r1, z1) turned about the body's z axis, seen from both sides."""
        return self._add(
            REVOLVED, [r0, z0, r1, z1], extent=np.hypot(max(r0, r1), max(abs(z0), abs(z1)))
        )

    def disc(self, radius: float, z: float = 0.0) -> WallSet:
        """Flat disc normal to z, with its rim."""
        return self.revolved(0.0, z, radius, z)

    def cylinder(self, radius: float, z0: float, z1: float) -> WallSet:
        """Open cylinder about z."""
        return self.revolved(radius, z0, radius, z1)

    def frustum(self, r0: float, z0: float, r1: float, z1: float) -> WallSet:
        """Open cone about z: a funnel's flank."""
        return self.revolved(r0, z0, r1, z1)

    def rectangle(self, centre: ArrayLike, half_u: ArrayLike, half_v: ArrayLike) -> WallSet:
        """Rectangle with half edges half_u, half_v (3,), seen from both sides. Raises ValueError
        where they are not at right angles or zero."""
        centre, half_u, half_v = (np.asarray(v, float) for v in (centre, half_u, half_v))
        area = length(half_u) * length(half_v)
        if not abs(float((half_u * half_v).sum())) < RIGHT * area:
            raise ValueError("a rectangle's half edges must be at right angles and not zero")
        extent = length(centre) + length(half_u) + length(half_v)
        return self._add(RECTANGLE, [*centre, *half_u, *half_v], extent=extent)

    def box(self, low: ArrayLike, high: ArrayLike, *, lid: bool = False) -> WallSet:
        """Five rectangles that enclose low..high, open at the top unless `lid`."""
        low, high = np.asarray(low, float), np.asarray(high, float)
        c, h = 0.5 * (low + high), 0.5 * (high - low)
        e = np.eye(3)
        for axis, (u, v) in enumerate(((1, 2), (2, 0), (0, 1))):
            for side in (-1.0, 1.0):
                if axis == 2 and side > 0 and not lid:
                    continue
                self.rectangle(c + side * h[axis] * e[axis], h[u] * e[u], h[v] * e[v])
        return self

    def mesh(self, vertices: ArrayLike, triangles: ArrayLike) -> WallSet:
        """Triangle mesh: vertices (v, 3) [m], triangles (t, 3) vertex numbers."""
        vertices = np.asarray(vertices, float)
        for corner in np.asarray(triangles):
            points = vertices[corner]
            self._add(TRIANGLE, points.ravel(), float(length(points).max()))
        return self

    def index(self, name: str) -> int:
        """Number of a body. Raises KeyError."""
        names = [b["name"] for b in self.bodies]
        if name not in names:
            raise KeyError(f"no wall body named {name!r}; there are: {', '.join(names)}")
        return names.index(name)

    def uses(self, material: str) -> bool:
        """Return whether any body is of this material."""
        return any(b["material"] == material for b in self.bodies)

    @property
    def elements(self) -> list[tuple[int, list[float], str]]:
        """(kind, parameters, body name) of each element, for pictures."""
        return [(k, list(p), self.bodies[b]["name"]) for k, p, b, _ in self._elements]

    def compile(self, material_names: Sequence[str]) -> Walls:
        """Arrays for the kernels. Raises ValueError for a material that is not among
        `material_names`."""
        walls = new_walls(len(self._elements), len(self.bodies))
        for k, b in enumerate(self.bodies):
            if b["material"] not in material_names:
                raise ValueError(f"wall {b['name']!r}: unknown material {b['material']!r}")
            for key in ("origin", "velocity", "spin"):
                getattr(walls, key)[k] = b[key]
            if b["free"]:
                axis = np.asarray(b["free"]["axis"], float)
                walls.axis[k] = axis / length(axis)
                walls.mass[k], walls.load[k] = b["free"]["mass"], b["free"]["load"]
                walls.drag[k] = b["free"].get("drag", 0.0)
        for e, (kind, numbers, body, extent) in enumerate(self._elements):
            walls.kind[e], walls.body[e] = kind, body
            walls.parameters[e, : len(numbers)] = numbers
            assert len(numbers) <= N_PARAMETERS
            walls.material[e] = material_names.index(self.bodies[body]["material"])
            walls.extent[body] = max(walls.extent[body], extent)
            walls.unbounded[body] |= kind == PLANE
        return walls
