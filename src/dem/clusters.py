"""Rigid bodies made of bonded spheres: the members' forces move the body, the body moves its members."""

import math

import numpy as np
from numba import njit

from dem.walls.motion import rotate


@njit(cache=True, error_model="numpy")
def _spin_of(rotation, inertia, momentum):
    """Angular velocity (3,) of angular momentum (3,), both in space."""
    body = rotation.T @ momentum
    return rotation @ (body / inertia)


@njit(cache=True, error_model="numpy")
def advance_clusters(clusters, particles, row_of, gravity, dt):
    """Kick and drift all clusters and set their members; True when a member has left its skin.

    row_of (particles,) int64: row of each tag.
    """
    stale = False
    for c in range(len(clusters.mass)):
        x, r = clusters.position[c], clusters.rotation[c]
        force, torque, resistance = clusters.mass[c] * gravity, np.zeros(3), 0.0
        for q in range(clusters.start[c], clusters.start[c + 1]):
            i = row_of[clusters.member[q]]
            f = particles.force[i].astype(np.float64)
            force += f[:3]
            torque += f[3:6] + np.cross(particles.position[i, :3] - x, f[:3])
            resistance += f[6]
        v, momentum = clusters.velocity[c], clusters.momentum[c]
        v += dt * force / clusters.mass[c]
        momentum += dt * torque
        size = math.sqrt((momentum**2).sum())
        if resistance > 0.0 and size > 0.0:
            momentum *= max(0.0, 1.0 - dt * resistance / size)
        # the spin at the middle of the step, from the orientation there
        middle = r.copy()
        w = _spin_of(middle, clusters.inertia[c], momentum)
        rotate(middle, w[0], w[1], w[2], 0.5 * dt)
        w = _spin_of(middle, clusters.inertia[c], momentum)
        x += dt * v
        rotate(r, w[0], w[1], w[2], dt)
        stale |= _place_members(c, clusters, particles, row_of, v, w)
    return stale


@njit(cache=True, error_model="numpy")
def _place_members(c, clusters, particles, row_of, velocity, spin):
    stale = False
    for q in range(clusters.start[c], clusters.start[c + 1]):
        i = row_of[clusters.member[q]]
        arm = clusters.rotation[c] @ clusters.offset[q]
        new = clusters.position[c] + arm
        moved = 0.0
        for k in range(3):
            particles.drift[i, k] += new[k] - particles.position[i, k]
            moved += particles.drift[i, k] ** 2
            particles.position[i, k] = new[k]
        surface = velocity + np.cross(spin, arm)
        particles.kinetic[i, 0:3] = surface
        particles.kinetic[i, 3:6] = spin
        stale |= moved > particles.drift[i, 3]
    return stale
