"""Arrays that hold a simulation's state, as named tuples that the kernels take.

`real` is float32 in mixed precision and float64 in double precision. In mixed precision position
and kinetic are two views of one buffer of 64-byte rows, so that one cache line holds all that a
contact needs of a particle. Rows are kept in spatial order; `tag` says which particle a row belongs
to. Two rows beyond the last are ghosts, far from everything, that fill up the last vector of pairs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from dem.kernel.simd import FIELDS, WIDTH

GHOSTS = 2
FAR = 1e6  # where the ghosts are [m]
REAL = {"mixed": np.float32, "double": np.float64}


class Particles(NamedTuple):
    """Row arrays; n particles and GHOSTS ghosts."""

    position: np.ndarray
    """(n, 4) float64: x, y, z [m]; radius [m], beside them for the test of distance."""
    kinetic: np.ndarray
    """(n, 8) real: velocity [m/s], angular velocity [rad/s], both half a step behind the position;
    radius [m]; mass [kg]."""
    inverse: np.ndarray
    """(n, 2) real: 1/mass [1/kg], 1/moment of inertia [1/(kg m2)]."""
    force: np.ndarray
    """(n, 8) real: force [N], torque [N m], resistance to own spin [N m], sum of normal loads
    [N]."""
    drift: np.ndarray
    """(n, 4) real: displacement since the pair list was built [m]; squared skin [m2]."""
    carry: np.ndarray
    """(n, 8) real: what rounding has left over of the velocities [m/s], [rad/s], which the next
    step adds; two unused."""
    tag: np.ndarray
    """(n,) int64: number of the particle, in the order of adding."""
    material: np.ndarray
    """(n,) int32."""
    cluster: np.ndarray
    """(n,) int32: rigid cluster it belongs to, -1 for none."""


class Pairs(NamedTuple):
    """Candidate pairs in blocks of WIDTH; every block is of one pair of materials."""

    first: np.ndarray
    """(m,) int32 row of the first particle."""
    second: np.ndarray
    """(m,) int32."""
    kind: np.ndarray
    """(m / WIDTH,) int32 row of the property table."""
    history: np.ndarray
    """(m / WIDTH, FIELDS, WIDTH) real, fields of `dem.contact.model`."""


class WallContacts(NamedTuple):
    """Candidate contacts of particles with wall elements, sorted by particle."""

    particle: np.ndarray
    """(m,) int32 row."""
    element: np.ndarray
    """(m,) int32 wall element."""
    history: np.ndarray
    """(m, FIELDS) float64."""


class WallScratch(NamedTuple):
    """Room for one evaluation of the wall contacts; nothing in it outlives a step."""

    point: np.ndarray
    """(m, 3) float64 closest point of each candidate [m]."""
    distance: np.ndarray
    """(m,) float64 [m]."""
    coverer: np.ndarray
    """(m,) int64 contact whose element of the body is closer there, or -1."""
    merged: np.ndarray
    """(m,) bool: one contact was made of this one and others; `point` has its direction."""
    acts: np.ndarray
    """(m,) bool: the particle feels this contact."""
    push: np.ndarray
    """(m, 3) float64 force on the particle of each contact that acts [N]."""
    turn: np.ndarray
    """(m, 3) float64 torque of rolling and torsion on it [N m]."""


class Clusters(NamedTuple):
    """Rigid bodies made of spheres; k clusters, q members."""

    start: np.ndarray
    """(k + 1,) int64 first member of each cluster."""
    member: np.ndarray
    """(q,) int64 tag of each member."""
    offset: np.ndarray
    """(q, 3) float64 member position in the body's principal frame [m]."""
    position: np.ndarray
    """(k, 3) float64 centre of mass [m]."""
    rotation: np.ndarray
    """(k, 3, 3) float64, body to space."""
    velocity: np.ndarray
    """(k, 3) float64 at the half step [m/s]."""
    momentum: np.ndarray
    """(k, 3) float64 angular momentum at the half step, in space [kg m2/s]."""
    mass: np.ndarray
    """(k,) float64 [kg]."""
    inertia: np.ndarray
    """(k, 3) float64 principal moments [kg m2]."""


def aligned(shape: tuple[int, ...], dtype: DTypeLike) -> np.ndarray:
    """Zeroed array whose data starts on a 64-byte boundary, so that a row is a cache line."""
    size = math.prod(shape) * np.dtype(dtype).itemsize
    raw = np.zeros(size + 64, np.uint8)
    return np.ndarray(shape, dtype, raw, offset=-raw.ctypes.data % 64)


def new_particles(n: int, precision: str) -> Particles:
    """Particles for n rows and the ghosts; precision is 'mixed' or 'double'."""
    rows, real = n + GHOSTS, REAL[precision]
    if precision == "mixed":
        buffer = aligned((rows, 8), np.float64)
        position, kinetic = buffer[:, :4], buffer.view(np.float32)[:, 8:]
    else:
        position, kinetic = aligned((rows, 4), np.float64), aligned((rows, 8), np.float64)
    inverse, force, drift, carry = (aligned((rows, k), real) for k in (2, 8, 4, 8))
    particles = Particles(
        position, kinetic, inverse, force, drift, carry, tag=np.full(rows, -1, np.int64),
        material=np.zeros(rows, np.int32), cluster=np.full(rows, -1, np.int32),
    )  # fmt: skip
    place_ghosts(particles, n)
    return particles


def place_ghosts(particles: Particles, n: int) -> None:
    """Put the two ghosts behind row n - 1; they touch nothing and not each other."""
    for k in range(GHOSTS):
        particles.position[n + k, :3] = FAR * (k + 1)
        particles.position[n + k, 3] = 1.0
        particles.kinetic[n + k] = 0.0
        particles.kinetic[n + k, 6:] = 1.0
        particles.inverse[n + k] = 0.0
        particles.force[n + k] = 0.0


def new_pairs(capacity: int, precision: str) -> Pairs:
    """Room for `capacity` pairs, rounded up to whole blocks."""
    blocks = -(-capacity // WIDTH)
    first, second = np.zeros((2, blocks * WIDTH), np.int32)
    history = aligned((blocks, FIELDS, WIDTH), REAL[precision])
    return Pairs(first, second, np.zeros(blocks, np.int32), history)


def new_wall_contacts(capacity: int) -> WallContacts:
    """Room for `capacity` candidate wall contacts."""
    particle, element = np.zeros((2, capacity), np.int32)
    return WallContacts(particle, element, np.zeros((capacity, FIELDS)))


def new_wall_scratch(capacity: int) -> WallScratch:
    """Scratch for `capacity` candidate wall contacts."""
    point, push, turn = np.zeros((3, capacity, 3))
    merged, acts = np.zeros((2, capacity), np.bool_)
    coverer = np.zeros(capacity, np.int64)
    return WallScratch(point, np.zeros(capacity), coverer, merged, acts, push, turn)


def no_clusters() -> Clusters:
    """Clusters without any."""
    start, member = np.zeros(1, np.int64), np.zeros(0, np.int64)
    offset, position, velocity, momentum, inertia = np.zeros((5, 0, 3))
    rotation, mass = np.zeros((0, 3, 3)), np.zeros(0)
    return Clusters(start, member, offset, position, rotation, velocity, momentum, mass, inertia)
