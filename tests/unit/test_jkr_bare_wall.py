"""JKR where one of the surfaces has no energy, and particles that are nowhere: an error, not a
crash."""

from typing import NamedTuple

import numpy as np
import pytest

from dem.contact.cohesion import jkr
from dem.contact.registry import ContactParameters, Laws, Material
from dem.errors import BlowUpError
from dem.simulation import Simulation
from dem.walls.builder import WallSet
from facts import refused

GRAIN = Material(1210.0, 1e7, 0.25)
RADIUS = 1e-3


class Surface(NamedTuple):
    """What the law needs of a pair of materials."""

    cohesion: float
    young: float = 1e7


@pytest.mark.parametrize("overlap", [1e-9, 1e-6, 1e-4])
def test_without_surface_energy_the_contact_radius_is_that_of_hertz(overlap):
    bare = Surface(0.0)
    assert jkr.reach(bare, RADIUS) == pytest.approx(0.0, abs=1e-12)
    assert jkr.contact_radius(bare, overlap, RADIUS) == pytest.approx(np.sqrt(RADIUS * overlap))


@pytest.mark.parametrize("energy", [0.0, 0.03])
def test_beyond_the_reach_the_contact_radius_is_finite(energy):
    p = Surface(energy)
    assert np.isfinite(jkr.contact_radius(p, -RADIUS, RADIUS))


def drop(n):
    contacts = {
        ("grain", "grain"): ContactParameters(0.5, 0.5, 0.1, surface_energy=0.03),
        ("grain", "wall"): ContactParameters(0.5, 0.5, 0.1),
    }
    walls = WallSet().body("plate", material="wall").plane((0, 0, 0), (0, 0, 1))
    materials = {"grain": GRAIN, "wall": Material(7800.0, 8e10, 0.3)}
    sim = Simulation(materials, contacts, laws=Laws(cohesion="jkr"), time_step=5e-6, walls=walls)
    position = np.column_stack([3e-3 * np.arange(n), np.zeros(n), np.full(n, 1.2 * RADIUS)])
    sim.add_particles(position, RADIUS)
    return sim


def test_cohesive_grains_bounce_on_a_wall_without_energy():
    sim = drop(5)
    sim.advance(2000)
    assert np.isfinite(sim.position).all()
    assert sim.wall_impulse("plate")[2] < 0.0  # they have met


def test_a_particle_that_is_nowhere_stops_the_run():
    sim = drop(5)
    sim.particles.position[2, 0] = np.nan
    with refused(BlowUpError, particle=2, time=0.0):
        sim.advance(10)
