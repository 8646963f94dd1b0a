"""Arrays that hold a simulation's state, as named tuples that the kernels take.

`real` is float32 in mixed precision and float64 in double precision. In mixed precision position
and kinetic are two views of one buffer of 64-byte rows, so that one cache line holds all that a
contact needs of a particle. Rows are kept in spatial order; `tag` says which particle a row belongs
to. Two rows beyond the last are ghosts, far from everything, that fill up the last vector of pairs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from dem.kernel.simd import FIELDS, WIDTH

GHOSTS = 2
FAR = 1e6  # where the ghosts are [m]


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
    stage: np.ndarray
    """(5, FIELDS, WIDTH) real: geometry, wall spin, history in; force columns, history out, and the
    torque of rolling and torsion in place of the spin."""
    staged: np.ndarray
    """(WIDTH,) int32 candidate in each lane."""
    rows: np.ndarray
    """(WIDTH,) int32 row of its particle."""


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
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + 64, np.uint8)
    start = -raw.ctypes.data % 64
    return raw[start : start + size].view(dtype).reshape(shape)


def new_particles(n: int, precision: str) -> Particles:
    """Particles for n rows and the ghosts; precision is 'mixed' or 'double'."""
    rows = n + GHOSTS
    if precision == "mixed":
        real = np.float32
        buffer = aligned((rows, 8), np.float64)
        position = buffer[:, :4]
        kinetic = buffer.view(np.float32)[:, 8:]
    else:
        real = np.float64  # type: ignore[assignment]
        position, kinetic = aligned((rows, 4), np.float64), aligned((rows, 8), np.float64)
    particles = Particles(
        position,
        kinetic,
        aligned((rows, 2), real),
        aligned((rows, 8), real),
        aligned((rows, 4), real),
        aligned((rows, 8), real),
        np.full(rows, -1, np.int64),
        np.zeros(rows, np.int32),
        np.full(rows, -1, np.int32),
    )
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
    real = np.float32 if precision == "mixed" else np.float64
    blocks = -(-capacity // WIDTH)
    return Pairs(
        np.zeros(blocks * WIDTH, np.int32),
        np.zeros(blocks * WIDTH, np.int32),
        np.zeros(blocks, np.int32),
        aligned((blocks, FIELDS, WIDTH), real),
    )


def new_wall_contacts(capacity: int) -> WallContacts:
    """Room for `capacity` candidate wall contacts."""
    return WallContacts(
        np.zeros(capacity, np.int32), np.zeros(capacity, np.int32), np.zeros((capacity, FIELDS))
    )


def new_wall_scratch(capacity: int, precision: str) -> WallScratch:
    """Scratch for `capacity` candidate wall contacts."""
    return WallScratch(
        np.zeros((capacity, 3)),
        np.zeros(capacity),
        np.zeros(capacity, np.int64),
        np.zeros(capacity, np.bool_),
        np.zeros(capacity, np.bool_),
        np.zeros((capacity, 3)),
        np.zeros((capacity, 3)),
        *new_stage(precision),
    )


def new_stage(precision: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`stage`, `staged` and `rows` of `WallScratch`: what each thread needs for itself, in cache
    lines of its own."""
    real = np.float32 if precision == "mixed" else np.float64
    return (
        aligned((5, FIELDS, WIDTH), real),
        aligned((WIDTH,), np.int32),
        aligned((WIDTH,), np.int32),
    )


def no_clusters() -> Clusters:
    """Clusters without any."""
    return Clusters(
        np.zeros(1, np.int64),
        np.zeros(0, np.int64),
        np.zeros((0, 3)),
        np.zeros((0, 3)),
        np.zeros((0, 3, 3)),
        np.zeros((0, 3)),
        np.zeros((0, 3)),
        np.zeros(0),
        np.zeros((0, 3)),
    )
