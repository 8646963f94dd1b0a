"""Where elements of one body meet: one contact in each place where the body's surface is closest to
the grain.

Every element gives its own closest point. One that lies on another element whose closest point is
nearer is no local minimum of the distance to the body: along that element the surface comes nearer
still. So a seam, an edge or a corner counts once, or not at all beside a face, whatever elements
meet in it and however they are cut; and a contact that passes from one element to its neighbour
takes its history along. Hu, Hu, Liu, Chen (2013), Powder Technology 241:98, sort the contacts of
conforming meshes to the same end by shared edges.
"""

import math

from numba import njit

from dem.lanes import inlined
from dem.walls.geometry import closest_point

JOINED = 1e-4  # of the grain's radius: gaps up to this between elements are none
ALONG = 1.0 - 1e-6  # cosine between normals: beyond it one point is straight behind the other


@njit(cache=True, error_model="numpy")
def resolve_joints(particles, walls, contacts, count, scratch):
    """Put all but the local minima of the distance to each body out of reach; `scratch` as left by
    the measuring."""
    particle, element, body = contacts.particle, contacts.element, walls.body
    kinetic, history, distance = particles.kinetic, contacts.history, scratch.distance
    lo = 0
    while lo < count:
        i, b = particle[lo], body[element[lo]]
        radius, acting = float(kinetic[i, 6]), 0
        hi = lo
        while hi < count and particle[hi] == i and body[element[hi]] == b:
            acting += distance[hi] < radius or history[hi, 6] != 0.0
            hi += 1
        if acting > 1:
            _resolve(particles, walls, contacts, lo, hi, scratch, radius)
        lo = hi


@njit(cache=True, error_model="numpy")
def _resolve(particles, walls, contacts, lo, hi, scratch, radius):
    """Resolve the contacts lo..hi-1 of one grain with one body."""
    distance, history, covered = scratch.distance, contacts.history, scratch.covered
    x, y, z = _in_body(particles, walls, contacts, lo)
    for k in range(lo, hi):
        acts = distance[k] < radius or history[k, 6] != 0.0
        covered[k] = acts and _is_covered(walls, contacts, lo, hi, k, scratch, radius, x, y, z)
    for k in range(lo, hi):
        if distance[k] < radius and history[k, 6] == 0.0 and not covered[k]:
            _take_history(history, covered, scratch.point, lo, hi, k)
    for k in range(lo, hi):
        if covered[k]:
            history[k] = 0.0
            distance[k] = 2.0 * radius


@inlined
def _in_body(particles, walls, contacts, k):
    """Position of candidate k's grain in the frame of its body."""
    p, b = particles.position[contacts.particle[k]], walls.body[contacts.element[k]]
    o, r = walls.origin[b], walls.rotation[b]
    x, y, z = p[0] - o[0], p[1] - o[1], p[2] - o[2]
    return (
        r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
        r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
        r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
    )


@inlined
def _is_covered(walls, contacts, lo, hi, k, scratch, radius, x, y, z):
    """Whether the closest point of contact k lies on an element that is closer to the grain at (x,
    y, z), or straight behind one; of elements that are closest in the same point the first
    counts."""
    distance, p = scratch.distance, scratch.point[k]
    for q in range(lo, hi):
        if q == k or not (distance[q] < distance[k] or (distance[q] == distance[k] and q < k)):
            continue
        e, nearer = contacts.element[q], scratch.point[q]
        _, _, _, gap = closest_point(walls.kind[e], walls.parameters[e], p[0], p[1], p[2])
        if abs(gap) <= JOINED * radius:
            return True
        cosine = (x - p[0]) * (x - nearer[0]) + (y - p[1]) * (y - nearer[1])
        cosine += (z - p[2]) * (z - nearer[2])
        if cosine > ALONG * abs(distance[k] * distance[q]) and distance[q] < radius:
            return True
    return False


@inlined
def _take_history(history, covered, point, lo, hi, k):
    """Give the new contact k the history of the nearest one that is covered now."""
    best, least = -1, math.inf
    for q in range(lo, hi):
        if covered[q] and history[q, 6] != 0.0:
            apart = (point[q, 0] - point[k, 0]) ** 2 + (point[q, 1] - point[k, 1]) ** 2
            apart += (point[q, 2] - point[k, 2]) ** 2
            if apart < least:
                best, least = q, apart
    if best >= 0:
        history[k] = history[best]
        history[best] = 0.0
