"""Mass, inertia and frame of rigid clusters, worked out once when they are added."""

import numpy as np

from dem.state import Clusters


def build_clusters(clusters, particles, n, tags, velocity):
    """Clusters with one more: the spheres `tags`, whose rows are the last of the n particles.

    The members' rows get the body's mass, so that damping and contact times are those of the body.
    """
    rows = np.flatnonzero(np.isin(particles.tag[:n], tags))
    position = np.array(particles.position[rows, :3])
    radius = particles.kinetic[rows, 6].astype(float)
    mass = particles.kinetic[rows, 7].astype(float)
    centre = mass @ position / mass.sum()
    arm = position - centre
    own = 0.4 * mass * radius**2
    tensor = np.eye(3) * own.sum()
    tensor += (
        mass[:, None, None]
        * ((arm**2).sum(1)[:, None, None] * np.eye(3) - arm[:, :, None] * arm[:, None, :])
    ).sum(0)
    moments, axes = np.linalg.eigh(tensor)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    particles.cluster[rows] = len(clusters.mass)
    particles.kinetic[rows, 7] = mass.sum()
    particles.inverse[rows, 0] = 1.0 / mass.sum()
    return Clusters(
        start=np.append(clusters.start, clusters.start[-1] + len(rows)),
        member=np.append(clusters.member, particles.tag[rows]),
        offset=np.vstack([clusters.offset, arm @ axes]),
        position=np.vstack([clusters.position, centre]),
        rotation=np.concatenate([clusters.rotation, axes[None]]),
        velocity=np.vstack([clusters.velocity, velocity]),
        momentum=np.vstack([clusters.momentum, np.zeros(3)]),
        mass=np.append(clusters.mass, mass.sum()),
        inertia=np.vstack([clusters.inertia, moments]),
    )
