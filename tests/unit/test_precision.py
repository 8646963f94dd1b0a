"""The fast path (float32 forces on SIMD lanes) against the float64 reference path: the same law."""

import numpy as np
import pytest

from dem.contact.registry import ContactParameters, Laws
from law_cases import alone, values
from scenes import floor, make


def collide(precision, laws, contact):
    """Nine grains thrown at each other above a plate; returns their state after 400 steps."""
    sim = make(contact, laws=laws, walls=floor(), dt=5e-6, gravity=9.81, precision=precision)
    grid = np.array([(x, y, 0.0) for x in (-1, 0, 1) for y in (-1, 0, 1)]) * 2.02e-3
    sim.add_particles(grid + (0, 0, 1.0005e-3), 1e-3, velocity=-20.0 * grid, spin=1e4 * grid)
    sim.advance(400)
    return np.concatenate(
        [sim.position.ravel() / 1e-3, sim.velocity.ravel(), sim.spin.ravel() * 1e-3]
    )


TOGETHER = [
    Laws(damping="viscoelastic", rolling="constant_torque_relative"),
    Laws(damping="plastic", rolling="elastic_plastic"),
    Laws(damping="restitution_curve", friction="friction_curve"),
    Laws(cohesion="jkr", rolling="elastic_plastic"),
    Laws(normal="eepa", damping="none", torsion="marshall"),
]
"""Laws that meet in one contact, beside each law alone."""

LAWS = dict.fromkeys(laws for _, laws in alone()) | dict.fromkeys(TOGETHER)


@pytest.mark.slow
@pytest.mark.parametrize("laws", LAWS, ids=lambda laws: "-".join(vars(laws).values()))
def test_lanes_and_floats_run_the_same_law(laws):
    contact = ContactParameters(0.5, 0.4, 0.1, **values(laws))
    fast, plain = collide("mixed", laws, contact), collide("double", laws, contact)
    # over 400 steps float32 rounding (6e-8) grows in the collisions to about a thousandth of the
    # motion
    assert np.abs(fast - plain).max() < 5e-3 * np.abs(plain).max()
    assert np.abs(fast - plain).max() > 0.0
