"""The time step that a pressed grain bears is shorter the more walls press it and the deeper.

A grain in a square tube touches four walls, each with the tangential stiffness k_t = 8 G* a and the
dashpot c_t = 2 sqrt(5/6) b sqrt(k_t m). Its spin about the tube's axis turns against all four:
m w'/2.5 = -4 (k_t s + c_t w). With the velocity half a step behind the position, such an oscillator
is stable while (W dt)^2 + 2 C dt < 4, W^2 = 10 k_t/m, C = 10 c_t/m.
"""

import math

import numpy as np
import pytest
from scenes import SALT, STEEL, ContactParameters, WallSet, effective, make, mass_of

R, E = 1e-3, 0.5


def limit(overlap, walls=4):
    """The longest stable time step [s] of a grain that `walls` about it press by an overlap [m]."""
    _, shear = effective(SALT, STEEL)
    m, damping = mass_of(R, SALT), -math.log(E) / math.hypot(math.log(E), math.pi)
    stiff = 8.0 * shear * math.sqrt(R * overlap)
    square = 2.5 * walls * stiff / m
    resisting = 2.5 * walls * 2.0 * math.sqrt(5.0 / 6.0) * damping * math.sqrt(stiff / m)
    return (math.sqrt(resisting**2 + 4.0 * square) - resisting) / square


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("share", [0.9, 1.1])
@pytest.mark.parametrize("overlap", [0.01, 0.05])
def test_a_grain_in_a_tube_trembles_beyond_its_time_step(overlap, share, precision):
    """A small spin dies out below the limit; above it grows until the grain slides."""
    half = (1.0 - overlap) * R
    walls = WallSet().body("tube", material="wall")
    for side in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)):
        walls.plane(half * np.array(side), -np.array(side))
    dt = share * limit(overlap * R)
    sim = make(ContactParameters(E, 0.5), walls=walls, dt=dt, precision=precision)
    sim.add_particles([(0, 0, 0)], R, spin=[(0, 0, 0.1)])
    sim.advance(400)
    spin = abs(sim.spin[0, 2])
    assert spin < 1e-3 if share < 1.0 else spin > 10.0
