"""Beds of grains from a tenth of a micrometre to two metres: the same run in its own units.

By dimensional analysis a bed in which every length goes as h, every time as the root of h, every
stress as h and every density as 1 moves alike (Feng, Han, Owen and Loughran 2009, Engineering
Computations 26, 599). h is a power of four here, whose root is a power of two: nothing is rounded
otherwise. A law that adds a number of its own to a length, force or moment, or that multiplies
small ones until float32 does not hold the product, gives another run.
"""

import numpy as np
import pytest

from dem.contact.law import Grain
from dem.contact.registry import ContactParameters, Material
from dem.simulation import Air, Simulation
from dem.walls.builder import WallSet
from law_cases import alone, values

TOPIC = "grains of any size"
SIDE, SPACING, RADIUS = 5, 2.1e-3, 1e-3  # grains along an edge, m, m
STEP, STEPS = 5e-6, 1500
POWERS = (5, -2, -7)  # of four: grains of 2 m to 0.12 um
EXACT, BY_LOGARITHM = 1e-6, 1e-3
"""Largest difference of a place, velocity or spin over the largest one: laws with roots that end
elsewhere in the last digit, and curves over a logarithm that is right to 3e-6."""

LAWS = dict(alone())
CURVES = ("damping-restitution_curve", "friction-friction_curve")


def bed(laws, parameters, h, precision):
    """(n, 9) place, velocity and spin of grains that fell into a cup, over their units; laws: a
    `Laws`; parameters: {name: value}."""
    root = np.sqrt(h)
    width = SIDE * SPACING
    walls = WallSet().body("cup", material="grain")
    walls.revolved(0.0, 0.0, 0.8 * width * h, 0.0)
    walls.revolved(0.8 * width * h, 0.0, 0.8 * width * h, 2.0 * width * h)
    sim = Simulation(
        {"grain": Material(1500.0, 1e7 * h, 0.25)},
        {("grain", "grain"): ContactParameters(0.5, 0.5, 0.2, **parameters)},
        laws=laws,
        time_step=STEP * root,
        walls=walls,
        precision=precision,
        air=Air(1.2, 1.8e-5 * h**1.5) if laws.drag != "none" else None,
    )
    rng, k = np.random.default_rng(1), np.arange(SIDE**3)
    site = np.column_stack([k % SIDE, k // SIDE % SIDE, k // SIDE**2]) * SPACING
    site += rng.uniform(-5e-5, 5e-5, site.shape) + [-0.4 * width, -0.4 * width, 1.1 * RADIUS]
    velocity, spin = (rng.uniform(-x, x, site.shape).astype(np.float32) for x in (0.5, 50.0))
    radius = float(np.float32(RADIUS))
    sim.add_particles(site * h, radius * h, velocity=velocity * root, spin=spin / root)
    sim.advance(STEPS)
    return np.concatenate([sim.position / h, sim.velocity / root, sim.spin * root], axis=1)


def differs(laws, parameters, precision):
    """Largest difference of a bed from that of grains of 2 mm; parameters: h -> {name: value}."""
    expected = bed(laws, parameters(1.0), 1.0, precision)
    size = np.abs(expected).max(axis=0)
    found = [bed(laws, parameters(h), h, precision) for h in (4.0**power for power in POWERS)]
    return max(np.abs((other - expected) / size).max() for other in found)


@pytest.mark.parametrize("name", LAWS)
def test_a_bed_of_grains_of_any_size_moves_alike(record, name):
    laws, grain = LAWS[name], Grain(Material(1500.0, 1e7, 0.25), RADIUS)
    worst = differs(laws, lambda h: values(laws, h, grain), "mixed")
    tolerance = BY_LOGARITHM if name in CURVES else EXACT
    what = f"largest difference from grains of 2 mm, {name}"
    record(TOPIC, what, worst, 0.0, tolerance, "", "dimensional analysis")
