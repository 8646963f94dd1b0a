"""Where elements of one body meet: one contact in each place where the body's surface is closest to
the grain.

Every element gives its own closest point. One that lies on another element whose closest point is
nearer is no local minimum of the distance to the body: along that element the surface comes nearer
still. So a seam, an edge or a corner counts once, or not at all beside a face, whatever elements
meet in it and however they are cut; and a contact that passes from one element to its neighbour
takes its history along, across a gap too. Hu, Hu, Liu, Chen (2013), Powder Technology 241:98, sort
the contacts of conforming meshes to the same end by shared edges.

A shallow valley has a local minimum on each side, and its seam lies within the grain. Two contacts
would then count what both press aside twice, and the second would come and go at once. As with two
sets that overlap, what they share is taken off: the force is that of both sides less that of the
seam, F = V'(R - d_1) n_1 + V'(R - d_2) n_2 - V'(R - d_seam) n_seam, which has a potential and
comes to that of one face as the valley becomes flat. It acts as one contact of this size and
direction.

Two bodies that lie in one plane, or share an edge, are as one surface too: what is no local minimum
of the distance to both counts once. Valleys between two bodies stay two contacts, as each body has
to know its own load.
"""

import math

import numpy as np
from numba import njit

from dem.kernel.simd import FIELDS, inlined
from dem.walls.geometry import closest_point, in_space, into_body

JOINED = 1e-4  # of the grain's radius: gaps up to this between elements are none
ALONG = 1.0 - 1e-6  # cosine between normals: beyond it one point is straight behind the other
PARALLEL = 1e-14  # square of the difference of two normals: below it their planes do not meet
HERTZ = 1.5  # power of the overlap in the force by which the sides of a valley are weighed


@njit(cache=True, error_model="numpy")
def resolve_joints(particles, walls, contacts, count, scratch):
    """Put all but the local minima of the distance to each body out of reach, and make one contact
    of those on the sides of a shallow valley; `scratch` as left by the measuring."""
    particle, element, history = contacts.particle, contacts.element, contacts.history
    body, kind, parameters, kinetic = walls.body, walls.kind, walls.parameters, particles.kinetic
    origin, rotation, position = walls.origin, walls.rotation, particles.position
    point, distance = scratch.point, scratch.distance
    coverer, merged = scratch.coverer, scratch.merged
    # a plain 0 would be tried as a constant first, and all that it is handed to compiled twice
    lo, acting, spanning = np.int64(0), 0, False
    begin, touched, several = np.int64(0), -1, False
    for k in range(count):
        i, b = np.uint32(particle[k]), np.uint32(body[np.uint32(element[k])])
        touching, held = distance[k] < kinetic[i, 6], history[k, 6] != 0.0
        if touching or held:
            acting += 1
            spanning |= not touching
            several |= touched >= 0 and touched != b
            touched = np.int64(b)
        if k + 1 < count and particle[k + 1] == i and body[np.uint32(element[k + 1])] == b:
            continue
        if acting > 1 or (spanning and k > lo):
            radius = float(kinetic[i, 6])
            x, y, z = into_body(origin, rotation, b, position[i, 0], position[i, 1], position[i, 2])
            _resolve(
                element, history, kind, parameters, point, distance, coverer, lo, k + 1, radius, x,
                y, z,
            )  # fmt: skip
            _merge(history, point, distance, merged, lo, k + 1, radius, x, y, z)
        lo, acting, spanning = k + 1, 0, False
        if k + 1 < count and particle[k + 1] == i:
            continue
        if several:
            _between_bodies(particles, walls, contacts, scratch, begin, k + 1)
        begin, touched, several = k + 1, -1, False


@njit(cache=True, error_model="numpy")
def _between_bodies(particles, walls, contacts, scratch, lo, hi):
    """Put those contacts lo..hi-1 of one grain out of reach whose closest point another body holds
    that is nearer, and hand their history on."""
    element, history, body = contacts.element, contacts.history, walls.body
    point, distance, coverer = scratch.point, scratch.distance, scratch.coverer
    i = np.uint32(contacts.particle[lo])
    radius = float(particles.kinetic[i, 6])
    x, y, z = particles.position[i, 0], particles.position[i, 1], particles.position[i, 2]
    for k in range(lo, hi):
        coverer[k] = -1
        if not (distance[k] < radius or history[k, 6] != 0.0):
            continue
        b = np.uint32(body[element[k]])
        px, py, pz = in_space(walls, b, point[k, 0], point[k, 1], point[k, 2])
        for q in range(lo, hi):
            c = np.uint32(body[element[q]])
            nearer = distance[q] < distance[k] or (distance[q] == distance[k] and q < k)
            if c == b or not nearer or distance[q] >= radius:
                continue
            e = element[q]
            u, v, w = into_body(walls.origin, walls.rotation, c, px, py, pz)
            _, _, _, gap = closest_point(walls.kind[e], walls.parameters[e], u, v, w)
            sx, sy, sz = in_space(walls, c, point[q, 0], point[q, 1], point[q, 2])
            cosine = (x - px) * (x - sx) + (y - py) * (y - sy) + (z - pz) * (z - sz)
            if abs(gap) <= JOINED * radius or cosine > ALONG * abs(distance[k] * distance[q]):
                coverer[k] = q
                break
    for k in range(lo, hi):
        last = coverer[k]
        if last < 0:
            continue
        while coverer[last] >= 0:
            last = coverer[last]
        if history[last, 6] == 0.0:
            for f in range(FIELDS):
                history[last, f] = history[k, f]
        history[k] = 0.0
        distance[k] = 2.0 * radius


@njit(cache=True, error_model="numpy")
def _resolve(element, history, kind, parameters, point, distance, coverer, lo, hi, radius, x, y, z):
    """Resolve the contacts lo..hi-1 of the grain at (x, y, z) of the body's frame with that
    body."""
    for k in range(lo, hi):
        acts = distance[k] < radius or history[k, 6] != 0.0
        coverer[k] = -1
        if acts:
            coverer[k] = _coverer(
                element, kind, parameters, point, distance, lo, hi, k, radius, x, y, z
            )
    for k in range(lo, hi):
        if history[k, 6] == 0.0 and coverer[k] < 0:
            _take_history(history, coverer, point, lo, hi, k, distance[k] < radius)
    for k in range(lo, hi):
        if coverer[k] >= 0:
            history[k] = 0.0
            distance[k] = 2.0 * radius


@inlined
def _coverer(element, kind, parameters, point, distance, lo, hi, k, radius, x, y, z):
    """The contact whose element is closer to the grain at (x, y, z) and holds the closest point of
    contact k, or has it straight behind its own, or -1; of elements that are closest in the same
    point the first counts."""
    px, py, pz = point[k, 0], point[k, 1], point[k, 2]
    for q in range(lo, hi):
        if q == k or not (distance[q] < distance[k] or (distance[q] == distance[k] and q < k)):
            continue
        e = element[q]
        _, _, _, gap = closest_point(kind[e], parameters[e], px, py, pz)
        if abs(gap) <= JOINED * radius:
            return q
        cosine = (x - px) * (x - point[q, 0]) + (y - py) * (y - point[q, 1])
        cosine += (z - pz) * (z - point[q, 2])
        if cosine > ALONG * abs(distance[k] * distance[q]) and distance[q] < radius:
            return q
    return -1


@inlined
def _take_history(history, coverer, point, lo, hi, k, touches):
    """Give the new contact k the history of the nearest one that is covered now; across a gap only
    of one that k covers itself, at first or second hand."""
    best, least = -1, math.inf
    for q in range(lo, hi):
        if coverer[q] >= 0 and history[q, 6] != 0.0:
            last = coverer[q]
            while coverer[last] >= 0:
                last = coverer[last]
            if not touches and last != k:
                continue
            apart = (point[q, 0] - point[k, 0]) ** 2 + (point[q, 1] - point[k, 1]) ** 2
            apart += (point[q, 2] - point[k, 2]) ** 2
            if apart < least:
                best, least = q, apart
    if best >= 0:
        for f in range(FIELDS):
            history[k, f] = history[best, f]
        history[best] = 0.0


@njit(cache=True, error_model="numpy")
def _merge(history, point, distance, merged, lo, hi, radius, x, y, z):
    """Make one contact of the nearest of lo..hi-1 and those that a seam within the grain joins to
    it; the grain's centre is (x, y, z) of the body's frame."""
    first, touching = -1, 0
    for k in range(lo, hi):
        if 0.0 < distance[k] < radius:
            touching += 1
            if first < 0 or distance[k] < distance[first]:
                first = k
    if touching < 2:
        return
    fx, fy, fz = _weighed(point, distance, first, radius, x, y, z)
    joined = False
    for k in range(lo, hi):
        if k == first or not 0.0 < distance[k] < radius:
            continue
        seam, sx, sy, sz = _seam(point, distance, lo, hi, k, radius, x, y, z)
        if seam >= radius:
            continue
        joined = True
        wx, wy, wz = _weighed(point, distance, k, radius, x, y, z)
        less = (radius - seam) ** HERTZ / seam
        fx, fy, fz = fx + wx + less * sx, fy + wy + less * sy, fz + wz + less * sz
        for f in range(FIELDS):  # springs add up; of what else is kept the larger counts
            both = history[first, f] + history[k, f]
            history[first, f] = both if f < 6 or f == 8 else max(history[first, f], history[k, f])
        history[k], merged[k] = 0.0, True
    if not joined:
        return
    for k in range(lo, hi):
        if merged[k]:
            distance[k] = 2.0 * radius
    force = math.sqrt(fx * fx + fy * fy + fz * fz)
    merged[first], distance[first] = True, radius - force ** (1.0 / HERTZ)
    away = distance[first] / force
    point[first, 0], point[first, 1], point[first, 2] = x - away * fx, y - away * fy, z - away * fz


@inlined
def _weighed(point, distance, k, radius, x, y, z):
    """Elastic force of contact k over its stiffness: towards the centre, overlap^HERTZ."""
    d = distance[k]
    w = (radius - d) ** HERTZ / d
    return w * (x - point[k, 0]), w * (y - point[k, 1]), w * (z - point[k, 2])


@inlined
def _seam(point, distance, lo, hi, k, radius, x, y, z):
    """Distance of the centre from the nearest seam of contact k with a nearer one, and the way
    there (3,): where the planes meet that touch the surface in their closest points."""
    least, sx, sy, sz = math.inf, 0.0, 0.0, 0.0
    dk = distance[k]
    ux, uy, uz = (point[k, 0] - x) / dk, (point[k, 1] - y) / dk, (point[k, 2] - z) / dk
    for q in range(lo, hi):
        dq = distance[q]
        nearer = dq < dk or (dq == dk and q < k)
        if q == k or not nearer or not 0.0 < dq < radius:
            continue
        vx, vy, vz = (point[q, 0] - x) / dq, (point[q, 1] - y) / dq, (point[q, 2] - z) / dq
        e = (ux - vx) ** 2 + (uy - vy) ** 2 + (uz - vz) ** 2  # 2 (1 - cosine)
        if e < PARALLEL:
            continue
        sine = e * (1.0 - 0.25 * e)  # its square
        away = math.sqrt(((dk - dq) ** 2 + dk * dq * e) / sine)
        if away < least:
            a, b = (dk - dq + 0.5 * e * dq) / sine, (dq - dk + 0.5 * e * dk) / sine
            least = away
            sx, sy, sz = a * ux + b * vx, a * uy + b * vy, a * uz + b * vz
    return least, sx, sy, sz
