"""JKR where one of the surfaces has no energy, and particles that are nowhere: an error, not a
crash."""

import numpy as np
import pytest

from dem.contact.registry import ContactParameters, Laws, Material
from dem.errors import BlowUpError
from dem.simulation import Simulation
from dem.walls.builder import WallSet
from facts import refused

GRAIN = Material(1210.0, 1e7, 0.25)
RADIUS = 1e-3


def drop(n, laws):
    contacts = {
        ("grain", "grain"): ContactParameters(0.5, 0.5, 0.1, surface_energy=0.03),
        ("grain", "wall"): ContactParameters(0.5, 0.5, 0.1),
    }
    walls = WallSet().body("plate", material="wall").plane((0, 0, 0), (0, 0, 1))
    materials = {"grain": GRAIN, "wall": Material(7800.0, 8e10, 0.3)}
    sim = Simulation(materials, contacts, laws=laws, time_step=5e-6, walls=walls)
    position = np.column_stack([3e-3 * np.arange(n), np.zeros(n), np.full(n, 1.2 * RADIUS)])
    sim.add_particles(position, RADIUS)
    return sim


def test_cohesive_grains_bounce_on_a_wall_without_energy_as_hertz_has_it():
    sim, hertz = drop(5, Laws(cohesion="jkr")), drop(5, Laws())
    for each in (sim, hertz):
        each.advance(2000)
    assert sim.position == pytest.approx(hertz.position, rel=1e-6)
    assert sim.wall_impulse("plate")[2] < 0.0  # they have met


def test_a_particle_that_is_nowhere_stops_the_run():
    sim = drop(5, Laws(cohesion="jkr"))
    sim.particles.position[2, 0] = np.nan
    with refused(BlowUpError, particle=2, time=0.0):
        sim.advance(10)
