"""Contacts of particles with walls: the candidate list and the forces.

A sphere that lies on the edge between two triangles of a mesh touches both, but there is one contact: an edge or a
corner counts only where no closer triangle shares it (Hu, Hu, Liu, Chen 2013, Powder Technology 241:98 sort contacts this way). A
contact that passes from one triangle to its neighbour takes its history along.
"""

import math

import numpy as np
from numba import njit

from dem.contact.model import wall_contact
from dem.contact.properties import properties_of
from dem.neighbours import LEVELS
from dem.walls.geometry import FACE, PLANE, REVOLVED, TRIANGLE, closest_point


@njit(cache=True, error_model="numpy")
def to_body(walls, b, x, y, z):
    """A point of space in the frame of body b."""
    o, r = walls.origin[b], walls.rotation[b]
    x, y, z = x - o[0], y - o[1], z - o[2]
    return (
        r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
        r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
        r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
    )


@njit(cache=True, error_model="numpy")
def turn(rotation, x, y, z):
    """rotation @ (x, y, z)."""
    return (
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z,
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z,
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z,
    )


@njit(cache=True, error_model="numpy")
def _within(walls, e, p, reach):
    b = walls.body[e]
    x, y, z = to_body(walls, b, p[0], p[1], p[2])
    _, _, _, d, _ = closest_point(walls.kind[e], walls.parameters[e], x, y, z)
    return d < reach


@njit(cache=True, error_model="numpy")
def _bounds(walls, e, low, high):
    """Fill the box (3,), (3,) of a rectangle or triangle in space."""
    p, b = walls.parameters[e], walls.body[e]
    corners = np.empty((4, 3))
    if walls.kind[e] == TRIANGLE:
        for k in range(3):
            corners[k] = p[3 * k : 3 * k + 3]
        corners[3] = corners[0]
    else:
        for k in range(4):
            s, t = (1.0 if k & 1 else -1.0), (1.0 if k & 2 else -1.0)
            corners[k] = p[:3] + s * p[3:6] + t * p[6:9]
    low[:] = np.inf
    high[:] = -np.inf
    for k in range(4):
        c = turn(walls.rotation[b], corners[k, 0], corners[k, 1], corners[k, 2])
        for a in range(3):
            low[a] = min(low[a], c[a] + walls.origin[b, a])
            high[a] = max(high[a], c[a] + walls.origin[b, a])


@njit(cache=True, error_model="numpy")
def find_wall_contacts(
    n, particles, walls, allowance, reach, cell_size, dims, first_cell, low, start, contacts, found
):
    """List the candidate contacts, sorted by particle; returns their number (see `find_pairs` for too little room).

    allowance (b,) is what each body may travel [m]; found (m, 2) int32 is scratch as long as the list's room.
    """
    count = 0
    box_low, box_high = np.empty(3), np.empty(3)
    for e in range(len(walls.kind)):
        extra = allowance[walls.body[e]]
        if walls.kind[e] == PLANE or walls.kind[e] == REVOLVED:
            for i in range(n):
                if _within(walls, e, particles.position[i], reach[i] + extra):
                    if count < len(found):
                        found[count, 0], found[count, 1] = i, e
                    count += 1
            continue
        _bounds(walls, e, box_low, box_high)
        for lv in range(LEVELS):
            size = cell_size[lv]
            if size == 0.0:
                continue
            margin = 0.5 * size + extra
            lo, hi = np.empty(3, np.int64), np.empty(3, np.int64)
            for k in range(3):
                lo[k] = max(int(math.floor((box_low[k] - margin - low[k]) / size)), 0)
                hi[k] = min(
                    int(math.floor((box_high[k] + margin - low[k]) / size)), dims[lv, k] - 1
                )
            if hi[0] < lo[0]:
                continue
            for cz in range(lo[2], hi[2] + 1):
                for cy in range(lo[1], hi[1] + 1):
                    row = first_cell[lv] + (cz * dims[lv, 1] + cy) * dims[lv, 0]
                    for i in range(start[row + lo[0]], start[row + hi[0] + 1]):
                        if _within(walls, e, particles.position[i], reach[i] + extra):
                            if count < len(found):
                                found[count, 0], found[count, 1] = i, e
                            count += 1
    if count <= len(found):
        _sort_by_particle(n, found, count, contacts)
    return count


@njit(cache=True)
def _sort_by_particle(n, found, count, contacts):
    begin = np.zeros(n + 1, np.int64)
    for k in range(count):
        begin[found[k, 0] + 1] += 1
    for i in range(n):
        begin[i + 1] += begin[i]
    for k in range(count):
        place = begin[found[k, 0]]
        begin[found[k, 0]] += 1
        contacts.particle[place] = found[k, 0]
        contacts.element[place] = found[k, 1]


@njit(cache=True)
def _shares(walls, e, feature, other):
    """Whether triangle `other` has the edge or corner `feature` of triangle e."""
    mine, theirs = walls.corner[e], walls.corner[other]
    if feature >= 4:
        wanted = (mine[feature - 4], mine[feature - 4])
    else:
        wanted = (mine[feature - 1], mine[feature % 3])
    hits = 0
    for w in wanted:
        for t in theirs:
            if t == w:
                hits += 1
                break
    return hits == 2


@njit(cache=True, error_model="numpy")
def _resolve_mesh(walls, contacts, lo, hi, distance, feature, radius):
    """Mark by distance = inf the triangle contacts lo..hi-1 of one particle that a closer triangle already covers."""
    for k in range(lo, hi):
        e = contacts.element[k]
        if walls.kind[e] != TRIANGLE or feature[k] == FACE or distance[k] >= radius:
            continue
        for q in range(lo, hi):
            other = contacts.element[q]
            if q == k or walls.kind[other] != TRIANGLE or walls.body[other] != walls.body[e]:
                continue
            # of two triangles that meet in the closest point, the first counts
            closer = distance[q] < distance[k] * (1.0 - 1e-9) or (
                distance[q] <= distance[k] * (1.0 + 1e-9) and (feature[q] == FACE or q < k)
            )
            if closer and _shares(walls, e, feature[k], other):
                distance[k] = np.inf
                break
    for k in range(lo, hi):
        e = contacts.element[k]
        if walls.kind[e] != TRIANGLE or distance[k] >= radius or contacts.history[k, 6] != 0.0:
            continue
        for q in range(lo, hi):
            other = contacts.element[q]
            given_up = distance[q] >= radius and contacts.history[q, 6] != 0.0
            if given_up and walls.kind[other] == TRIANGLE and walls.body[other] == walls.body[e]:
                contacts.history[k] = contacts.history[q]
                contacts.history[q] = 0.0
                break


@njit(cache=True, error_model="numpy")
def wall_forces(
    codes, table, wall_kind_of, dt, particles, walls, contacts, count, geometry, feature
):
    """Add the wall forces to the particles and to the bodies.

    table: properties of pairs; wall_kind_of (particle materials, wall materials): rows of it. geometry (m, 4) float64 and feature
    (m,) int32 are scratch: closest point and distance.
    """
    walls.force[:] = 0.0
    walls.torque[:] = 0.0
    lo = 0
    while lo < count:
        i = contacts.particle[lo]
        hi = lo
        p = particles.position[i]
        mesh = 0
        while hi < count and contacts.particle[hi] == i:
            e = contacts.element[hi]
            b = walls.body[e]
            x, y, z = to_body(walls, b, p[0], p[1], p[2])
            px, py, pz, d, feature[hi] = closest_point(walls.kind[e], walls.parameters[e], x, y, z)
            g = geometry[hi]
            g[0], g[1], g[2] = turn(walls.rotation[b], px, py, pz)
            g[3] = d
            mesh += walls.kind[e] == TRIANGLE
            hi += 1
        if mesh > 1:
            _resolve_mesh(
                walls, contacts, lo, hi, geometry[:, 3], feature, float(particles.kinetic[i, 6])
            )
        for k in range(lo, hi):
            _apply(codes, table, wall_kind_of, dt, particles, walls, contacts, k, geometry[k])
        lo = hi


@njit(cache=True, error_model="numpy")
def _apply(codes, table, wall_kind_of, dt, particles, walls, contacts, k, g):
    i, e = contacts.particle[k], contacts.element[k]
    kin, h = particles.kinetic[i], contacts.history[k]
    overlap = float(kin[6]) - g[3]
    if overlap <= 0.0 and h[6] == 0.0:
        return
    b = walls.body[e]
    o, v, w = walls.origin[b], walls.velocity[b], walls.spin[b]
    # g is the closest point relative to the body's origin, in space
    distance = g[3]
    if walls.kind[e] == PLANE:
        nx, ny, nz = turn(
            walls.rotation[b],
            walls.parameters[e, 3],
            walls.parameters[e, 4],
            walls.parameters[e, 5],
        )
    elif distance > 0.0 and distance < np.inf:
        p = particles.position[i]
        nx = (p[0] - o[0] - g[0]) / distance
        ny = (p[1] - o[1] - g[1]) / distance
        nz = (p[2] - o[2] - g[2]) / distance
    else:
        h[:] = 0.0
        return
    wall_velocity = (
        v[0] + w[1] * g[2] - w[2] * g[1],
        v[1] + w[2] * g[0] - w[0] * g[2],
        v[2] + w[0] * g[1] - w[1] * g[0],
    )
    particle = (
        float(kin[0]),
        float(kin[1]),
        float(kin[2]),
        float(kin[3]),
        float(kin[4]),
        float(kin[5]),
        float(kin[6]),
        float(kin[7]),
    )
    history = (h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7])
    row = wall_kind_of[particles.material[i], walls.material[e]]
    columns, history = wall_contact(
        codes,
        properties_of(table, row),
        dt,
        overlap,
        (nx, ny, nz),
        wall_velocity,
        (w[0], w[1], w[2]),
        particle,
        history,
    )
    for f in range(8):
        h[f] = history[f]
        particles.force[i, f] += columns[f]
    fx, fy, fz = columns[0], columns[1], columns[2]
    walls.force[b, 0] -= fx
    walls.force[b, 1] -= fy
    walls.force[b, 2] -= fz
    walls.torque[b, 0] -= g[1] * fz - g[2] * fy
    walls.torque[b, 1] -= g[2] * fx - g[0] * fz
    walls.torque[b, 2] -= g[0] * fy - g[1] * fx
