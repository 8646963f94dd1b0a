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

import numpy as np
from numba import njit

from dem.lanes import FIELDS, inlined
from dem.walls.geometry import closest_point, into_body

JOINED = 1e-4  # of the grain's radius: gaps up to this between elements are none
ALONG = 1.0 - 1e-6  # cosine between normals: beyond it one point is straight behind the other


@njit(cache=True, error_model="numpy")
def resolve_joints(particles, walls, contacts, count, scratch):
    """Put all but the local minima of the distance to each body out of reach; `scratch` as left by
    the measuring."""
    particle, element, history = contacts.particle, contacts.element, contacts.history
    body, kind, parameters, kinetic = walls.body, walls.kind, walls.parameters, particles.kinetic
    origin, rotation, position = walls.origin, walls.rotation, particles.position
    point, distance, covered = scratch.point, scratch.distance, scratch.covered
    lo, acting = 0, 0
    for k in range(count):
        i, b = np.uint32(particle[k]), np.uint32(body[np.uint32(element[k])])
        if distance[k] < kinetic[i, 6] or history[k, 6] != 0.0:
            acting += 1
        if k + 1 < count and particle[k + 1] == i and body[np.uint32(element[k + 1])] == b:
            continue
        if acting > 1:
            radius = float(kinetic[i, 6])
            x, y, z = into_body(origin, rotation, b, position[i, 0], position[i, 1], position[i, 2])
            _resolve(
                element, history, kind, parameters, point, distance, covered, lo, k + 1, radius, x,
                y, z,
            )  # fmt: skip
        lo, acting = k + 1, 0


@njit(cache=True, error_model="numpy")
def _resolve(element, history, kind, parameters, point, distance, covered, lo, hi, radius, x, y, z):
    """Resolve the contacts lo..hi-1 of the grain at (x, y, z) of the body's frame with that
    body."""
    for k in range(lo, hi):
        acts = distance[k] < radius or history[k, 6] != 0.0
        covered[k] = acts and _is_covered(
            element, kind, parameters, point, distance, lo, hi, k, radius, x, y, z
        )
    for k in range(lo, hi):
        if distance[k] < radius and history[k, 6] == 0.0 and not covered[k]:
            _take_history(history, covered, point, lo, hi, k)
    for k in range(lo, hi):
        if covered[k]:
            for f in range(FIELDS):
                history[k, f] = 0.0
            distance[k] = 2.0 * radius


@inlined
def _is_covered(element, kind, parameters, point, distance, lo, hi, k, radius, x, y, z):
    """Whether the closest point of contact k lies on an element that is closer to the grain at (x,
    y, z), or straight behind one; of elements that are closest in the same point the first
    counts."""
    px, py, pz = point[k, 0], point[k, 1], point[k, 2]
    for q in range(lo, hi):
        if q == k or not (distance[q] < distance[k] or (distance[q] == distance[k] and q < k)):
            continue
        e = element[q]
        _, _, _, gap = closest_point(kind[e], parameters[e], px, py, pz)
        if abs(gap) <= JOINED * radius:
            return True
        cosine = (x - px) * (x - point[q, 0]) + (y - py) * (y - point[q, 1])
        cosine += (z - pz) * (z - point[q, 2])
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
        for f in range(FIELDS):
            history[k, f] = history[best, f]
            history[best, f] = 0.0
