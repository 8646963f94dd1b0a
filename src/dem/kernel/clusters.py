"""Rigid bodies made of bonded spheres: the members' forces move the body, the body moves its
members."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from dem.kernel.arithmetic import add, cross, dot, scale
from dem.kernel.simd import inlined
from dem.kernel.state import Clusters
from dem.linear import into_axes, principal_axes
from dem.walls.geometry import along_body, out_of_body
from dem.walls.motion import rotate

if TYPE_CHECKING:
    from dem.kernel.state import Particles


def build_clusters(
    clusters: Clusters,
    particles: Particles,
    n: int,
    shape: tuple[int, int],
    velocity: np.ndarray,
    mass: np.ndarray | None = None,
    inertia: np.ndarray | None = None,
    centre: np.ndarray | None = None,
) -> Clusters:
    """Clusters with k more of m spheres each, shape (k, m): the last k m of the n particles, body
    after body.

    velocity (k, 3) at the half step [m/s]; mass (k,) [kg], inertia (k, 3, 3) about the centre of
    mass [kg m2], centre (k, 3) [m]: of the bodies where the sum over their spheres is not meant.
    The members' rows get the body's mass, so that damping and contact times are those of the body.
    """
    k, m = shape
    rows = np.arange(n - k * m, n)
    position = particles.position[rows, :3].reshape(k, m, 3)
    radius = particles.kinetic[rows, 6].astype(float).reshape(shape)
    own = particles.kinetic[rows, 7].astype(float).reshape(shape)
    if centre is None:
        centre = (own[:, :, None] * position).sum(1) / own.sum(1)[:, None]
    arm = position - centre[:, None]
    if mass is None:
        mass, inertia = _sum_of_spheres(own, radius, arm)
    moments, axes = principal_axes(inertia)  # type: ignore[arg-type]
    body = len(clusters.mass) + np.repeat(np.arange(k), m)
    particles.cluster[rows] = body
    particles.kinetic[rows, 7] = np.repeat(mass, m)
    particles.inverse[rows, 0] = 1.0 / np.repeat(mass, m)
    return Clusters(
        start=np.append(clusters.start, clusters.start[-1] + m * np.arange(1, k + 1)),
        member=np.append(clusters.member, particles.tag[rows]),
        offset=np.vstack([clusters.offset, into_axes(axes[:, None], arm).reshape(-1, 3)]),
        position=np.vstack([clusters.position, centre]),
        rotation=np.concatenate([clusters.rotation, axes]),
        velocity=np.vstack([clusters.velocity, velocity]),
        momentum=np.vstack([clusters.momentum, np.zeros((k, 3))]),
        mass=np.append(clusters.mass, mass),
        inertia=np.vstack([clusters.inertia, moments]),
    )


def _sum_of_spheres(mass, radius, arm):
    """Mass (k,) and inertia (k, 3, 3) of k bodies of m spheres: mass, radius (k, m), arm (k, m, 3)
    from the centre."""
    square = (arm**2).sum(2)
    round_part = (0.4 * mass * radius**2 + mass * square).sum(1)
    tensor = (mass[:, :, None, None] * arm[:, :, :, None] * arm[:, :, None, :]).sum(1)
    return mass.sum(1), round_part[:, None, None] * np.eye(3) - tensor


def drop_clusters(clusters: Clusters, keep: np.ndarray) -> Clusters:
    """Clusters without those where keep (k,) is false."""
    size = np.diff(clusters.start)
    held = np.repeat(keep, size)
    of_member = {"member": clusters.member[held], "offset": clusters.offset[held]}
    own = ("position", "rotation", "velocity", "momentum", "mass", "inertia")
    return Clusters(
        start=np.append(0, np.cumsum(size[keep])),
        **of_member,
        **{name: getattr(clusters, name)[keep] for name in own},
    )


@inlined
def _spin_of(clusters, c, momentum):
    """Angular velocity of cluster c at an angular momentum, both in space."""
    x, y, z = along_body(clusters.rotation, c, momentum[0], momentum[1], momentum[2])
    inertia = clusters.inertia[c]
    return out_of_body(clusters.rotation, c, x / inertia[0], y / inertia[1], z / inertia[2])


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
        w = _spin_of(clusters, c, turn)
        rotate(r, w[0], w[1], w[2], 0.5 * dt)
        w = _spin_of(clusters, c, turn)
        for k in range(9):
            r[k // 3, k % 3] = kept[k]
        rotate(r, w[0], w[1], w[2], dt)
        for k in range(3):
            momentum[k] = turn[k]
            x[k] += dt * v[k]
        for q in range(clusters.start[c], clusters.start[c + 1]):
            stale |= _place_member(clusters, c, q, row_of[clusters.member[q]], particles, w)
    return stale


@inlined
def _place_member(clusters, c, q, i, particles, w):
    """Move row i, member q of cluster c, to its place on the body that turns by w; True when it has
    left its skin."""
    offset, x, v = clusters.offset[q], clusters.position[c], clusters.velocity[c]
    arm = out_of_body(clusters.rotation, c, offset[0], offset[1], offset[2])
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
