"""Mass, inertia and frame of rigid clusters, worked out once when they are added."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dem.kernel.state import Clusters
from dem.linear import into_axes, principal_axes

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
