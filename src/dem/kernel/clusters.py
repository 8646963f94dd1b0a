"""Rigid bodies made of bonded spheres: the members' forces move the body, the body moves its
members."""

import math

from numba import njit

from dem.kernel.simd import inlined
from dem.kernel.vectors import add, cross, dot, scale
from dem.walls.motion import rotate


@inlined
def _turn(r, v):
    """r @ v for a rotation matrix (3, 3) and a tuple."""
    return (
        r[0, 0] * v[0] + r[0, 1] * v[1] + r[0, 2] * v[2],
        r[1, 0] * v[0] + r[1, 1] * v[1] + r[1, 2] * v[2],
        r[2, 0] * v[0] + r[2, 1] * v[1] + r[2, 2] * v[2],
    )


@inlined
def _spin_of(r, inertia, momentum):
    """Angular velocity of an angular momentum, both in space; inertia (3,) principal moments, r
    body to space."""
    x = (r[0, 0] * momentum[0] + r[1, 0] * momentum[1] + r[2, 0] * momentum[2]) / inertia[0]
    y = (r[0, 1] * momentum[0] + r[1, 1] * momentum[1] + r[2, 1] * momentum[2]) / inertia[1]
    z = (r[0, 2] * momentum[0] + r[1, 2] * momentum[1] + r[2, 2] * momentum[2]) / inertia[2]
    return _turn(r, (x, y, z))


@njit(cache=True, error_model="numpy")
def advance_clusters(clusters, particles, row_of, gravity, dt):
    """Kick and drift all clusters and set their members; True when a member has left its skin.

    row_of (particles,) int64: row of each tag.
    """
    stale = False
    for c in range(len(clusters.mass)):
        x, r = clusters.position[c], clusters.rotation[c]
        force, torque, resistance = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        for q in range(clusters.start[c], clusters.start[c + 1]):
            i = row_of[clusters.member[q]]
            f, p = particles.force[i], particles.position[i]
            push = (float(f[0]), float(f[1]), float(f[2]))
            arm = (p[0] - x[0], p[1] - x[1], p[2] - x[2])
            force = add(force, push)
            torque = add(torque, add((float(f[3]), float(f[4]), float(f[5])), cross(arm, push)))
            resistance += float(f[6])
        v, momentum, mass = clusters.velocity[c], clusters.momentum[c], clusters.mass[c]
        for k in range(3):
            v[k] += dt * (force[k] / mass + gravity[k])
        turn = add((momentum[0], momentum[1], momentum[2]), scale(dt, torque))
        size = math.sqrt(dot(turn, turn))
        if resistance > 0.0 and size > 0.0:
            turn = scale(max(0.0, 1.0 - dt * resistance / size), turn)
        # the spin at the middle of the step, from the orientation there; kept on the stack: a step
        # allocates nothing
        kept = (r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2])
        w = _spin_of(r, clusters.inertia[c], turn)
        rotate(r, w[0], w[1], w[2], 0.5 * dt)
        w = _spin_of(r, clusters.inertia[c], turn)
        for k in range(9):
            r[k // 3, k % 3] = kept[k]
        rotate(r, w[0], w[1], w[2], dt)
        for k in range(3):
            momentum[k] = turn[k]
            x[k] += dt * v[k]
        for q in range(clusters.start[c], clusters.start[c + 1]):
            stale |= _place_member(
                row_of[clusters.member[q]], particles, x, v, r, w, clusters.offset[q]
            )
    return stale


@inlined
def _place_member(i, particles, x, v, r, w, offset):
    """Move row i to its place on the body; True when it has left its skin."""
    arm = _turn(r, (offset[0], offset[1], offset[2]))
    surface = cross(w, arm)
    moved = 0.0
    for k in range(3):
        new = x[k] + arm[k]
        particles.drift[i, k] += new - particles.position[i, k]
        moved += float(particles.drift[i, k]) ** 2
        particles.position[i, k] = new
        particles.kinetic[i, k] = v[k] + surface[k]
        particles.kinetic[i, 3 + k] = w[k]
    return moved > particles.drift[i, 3]
