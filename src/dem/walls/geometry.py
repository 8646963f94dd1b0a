"""Closest points on wall elements, in the frame of the wall's body.

An element is a row of numbers:
    PLANE     point (3), normal (3): solid behind the plane
    REVOLVED  r0, z0, r1, z1: the segment from (r0, z0) to (r1, z1), turned about the z axis; a disc
              with its rim, a ring, a cylinder or a frustum
    RECTANGLE centre (3), half edge u (3), half edge v (3)
    TRIANGLE  corners a (3), b (3), c (3)
"""

import math

from dem.kernel.simd import inlined

PLANE, REVOLVED, RECTANGLE, TRIANGLE = range(4)
N_PARAMETERS = 9


@inlined
def into_body(origin, rotation, b, x, y, z):
    """A point of space in the frame of body b; origin (b, 3), rotation (b, 3, 3)."""
    return along_body(rotation, b, x - origin[b, 0], y - origin[b, 1], z - origin[b, 2])


@inlined
def along_body(rotation, b, x, y, z):
    """A vector of space in the frame of body b."""
    return (
        rotation[b, 0, 0] * x + rotation[b, 1, 0] * y + rotation[b, 2, 0] * z,
        rotation[b, 0, 1] * x + rotation[b, 1, 1] * y + rotation[b, 2, 1] * z,
        rotation[b, 0, 2] * x + rotation[b, 1, 2] * y + rotation[b, 2, 2] * z,
    )


@inlined
def out_of_body(rotation, b, x, y, z):
    """A vector of the frame of body b in space."""
    return (
        rotation[b, 0, 0] * x + rotation[b, 0, 1] * y + rotation[b, 0, 2] * z,
        rotation[b, 1, 0] * x + rotation[b, 1, 1] * y + rotation[b, 1, 2] * z,
        rotation[b, 2, 0] * x + rotation[b, 2, 1] * y + rotation[b, 2, 2] * z,
    )


@inlined
def in_space(walls, b, x, y, z):
    """A point of the frame of body b in space."""
    x, y, z = out_of_body(walls.rotation, b, x, y, z)
    return x + walls.origin[b, 0], y + walls.origin[b, 1], z + walls.origin[b, 2]


@inlined
def closest_point(kind, e, x, y, z):
    """Closest point of element `e` to (x, y, z) and the signed distance to it, negative only behind
    a plane."""
    if kind == PLANE:
        d = (x - e[0]) * e[3] + (y - e[1]) * e[4] + (z - e[2]) * e[5]
        return x - d * e[3], y - d * e[4], z - d * e[5], d
    if kind == REVOLVED:
        px, py, pz = _on_revolved(e, x, y, z)
    elif kind == RECTANGLE:
        px, py, pz = _on_rectangle(e, x, y, z)
    else:
        px, py, pz = _on_triangle(e, x, y, z)
    d = math.sqrt((x - px) ** 2 + (y - py) ** 2 + (z - pz) ** 2)
    return px, py, pz, d


@inlined
def _on_revolved(e, x, y, z):
    rho = math.sqrt(x * x + y * y)
    dr, dz = e[2] - e[0], e[3] - e[1]
    s = ((rho - e[0]) * dr + (z - e[1]) * dz) / (dr * dr + dz * dz)
    s = min(max(s, 0.0), 1.0)
    r, pz = e[0] + s * dr, e[1] + s * dz
    if rho > 0.0:
        return r * x / rho, r * y / rho, pz
    return r, 0.0, pz


@inlined
def _on_rectangle(e, x, y, z):
    dx, dy, dz = x - e[0], y - e[1], z - e[2]
    uu = e[3] * e[3] + e[4] * e[4] + e[5] * e[5]
    vv = e[6] * e[6] + e[7] * e[7] + e[8] * e[8]
    s = min(max((dx * e[3] + dy * e[4] + dz * e[5]) / uu, -1.0), 1.0)
    t = min(max((dx * e[6] + dy * e[7] + dz * e[8]) / vv, -1.0), 1.0)
    return e[0] + s * e[3] + t * e[6], e[1] + s * e[4] + t * e[7], e[2] + s * e[5] + t * e[8]


@inlined
def _on_triangle(e, x, y, z):
    """Voronoi regions of a triangle; Ericson (2005), Real-Time Collision Detection, section
    5.1.5."""
    abx, aby, abz = e[3] - e[0], e[4] - e[1], e[5] - e[2]
    acx, acy, acz = e[6] - e[0], e[7] - e[1], e[8] - e[2]
    apx, apy, apz = x - e[0], y - e[1], z - e[2]
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    if d1 <= 0.0 and d2 <= 0.0:
        return e[0], e[1], e[2]
    bpx, bpy, bpz = x - e[3], y - e[4], z - e[5]
    d3 = abx * bpx + aby * bpy + abz * bpz
    d4 = acx * bpx + acy * bpy + acz * bpz
    if d3 >= 0.0 and d4 <= d3:
        return e[3], e[4], e[5]
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / (d1 - d3)
        return e[0] + t * abx, e[1] + t * aby, e[2] + t * abz
    cpx, cpy, cpz = x - e[6], y - e[7], z - e[8]
    d5 = abx * cpx + aby * cpy + abz * cpz
    d6 = acx * cpx + acy * cpy + acz * cpz
    if d6 >= 0.0 and d5 <= d6:
        return e[6], e[7], e[8]
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6)
        return e[0] + t * acx, e[1] + t * acy, e[2] + t * acz
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return e[3] + t * (e[6] - e[3]), e[4] + t * (e[7] - e[4]), e[5] + t * (e[8] - e[5])
    v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    return e[0] + abx * v + acx * w, e[1] + aby * v + acy * w, e[2] + abz * v + acz * w
