"""The time loop allocates nothing: however many steps, as many allocations."""

import numpy as np
import pytest

from dem.contact.registry import ContactParameters, Material
from dem.simulation import Simulation
from dem.walls.builder import WallSet


def resting(cluster):
    """Grains, loose or bonded, that lie on a plate with one on top, and no list to be made
    again."""
    salt = Material(1200.0, 1e7, 0.25)
    sim = Simulation(
        {"salt": salt},
        {("salt", "salt"): ContactParameters(0.1, 0.5, 0.1)},
        time_step=1e-6,
        walls=WallSet().body("plate", material="salt").plane((0, 0, 0), (0, 0, 1)),
    )
    corners = 1e-3 * np.array([[0, 0, 1], [2, 0, 1], [0, 2, 1], [2, 2, 1]])
    if cluster:
        sim.add_clusters([corners], 1e-3)
    else:
        sim.add_particles(corners, 1e-3)
    sim.add_particles([[1e-3, 1e-3, 2.4142e-3]], 1e-3)
    sim.advance(20000)
    return sim


@pytest.fixture
def allocations():
    """Function that counts the allocations of numba's runtime over some steps between two makings
    of the lists."""
    # numba, imported before the engine, would keep its compiled code beside the sources
    from numba.core.runtime import _nrt_python, rtsys

    def count(sim, steps):
        before, made = rtsys.get_allocation_stats().alloc, sim.rebuilds
        sim.advance(steps)
        assert sim.rebuilds == made, "the lists were made again"
        return rtsys.get_allocation_stats().alloc - before

    was = _nrt_python.memsys_stats_enabled()
    _nrt_python.memsys_enable_stats()
    yield count
    if not was:
        _nrt_python.memsys_disable_stats()


@pytest.mark.parametrize("cluster", [False, True])
def test_the_time_loop_allocates_nothing(allocations, cluster):
    sim = resting(cluster)
    assert len(sim.contacts()[0]) > 0
    assert allocations(sim, 10) == allocations(sim, 500)
