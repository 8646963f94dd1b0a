"""Arrays of the walls: rigid bodies and the elements that they are made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dem.walls.geometry import N_PARAMETERS


class Walls(NamedTuple):
    """Wall elements (e of them), each in the frame of its body (b of them). All real numbers are
    float64, SI."""

    kind: np.ndarray
    """(e,) int32, see `dem.walls.geometry`."""
    parameters: np.ndarray
    """(e, N_PARAMETERS)."""
    body: np.ndarray
    """(e,) int32."""
    material: np.ndarray
    """(e,) int32."""
    origin: np.ndarray
    """(b, 3) position of the body's frame [m]."""
    rotation: np.ndarray
    """(b, 3, 3) body to space."""
    velocity: np.ndarray
    """(b, 3) of the body's origin [m/s]."""
    spin: np.ndarray
    """(b, 3) angular velocity about the origin [rad/s]."""
    mass: np.ndarray
    """(b,) [kg]; 0: the motion is prescribed. Otherwise the body moves freely along `axis` under
    its load."""
    axis: np.ndarray
    """(b, 3) unit vector of free motion."""
    load: np.ndarray
    """(b,) force applied along the axis [N]."""
    drag: np.ndarray
    """(b,) viscous resistance to motion along the axis [N s/m]."""
    force: np.ndarray
    """(b, 3) force of the particles at the last step [N]."""
    torque: np.ndarray
    """(b, 3) torque of the particles about the origin at the last step [N m]."""
    impulse: np.ndarray
    """(b, 3) time integral of `force` [N s]."""
    angular_impulse: np.ndarray
    """(b, 3) time integral of `torque` [N m s]."""
    travel: np.ndarray
    """(b,) bound on the path of any wall point since the lists were built [m]."""
    extent: np.ndarray
    """(b,) largest distance of a wall point from the body's origin that counts for `travel` [m]."""
    unbounded: np.ndarray
    """(b,) bool: a plane is among its elements, so that `extent` is as far as there are
    particles."""


def new_walls(elements: int, bodies: int) -> Walls:
    """Zeroed arrays for a number of elements and bodies, unrotated."""
    kind, body, material = np.zeros((3, elements), np.int32)
    origin, velocity, spin, axis, force, torque, impulse, angular_impulse = np.zeros((8, bodies, 3))
    mass, load, drag, travel, extent = np.zeros((5, bodies))
    return Walls(
        kind, np.zeros((elements, N_PARAMETERS)), body, material,
        origin, np.tile(np.eye(3), (bodies, 1, 1)), velocity, spin, mass, axis, load, drag,
        force, torque, impulse, angular_impulse, travel, extent, np.zeros(bodies, np.bool_),
    )  # fmt: skip
