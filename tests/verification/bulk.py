"""Beds of soft glass grains for the verification of bulk behaviour."""

import math

import numpy as np

from dem.contact.registry import Material
from dem.simulation import Simulation
from scenes import GRAVITY, Laws, rayleigh

SPREAD = 0.1
"""Grains are uniform in size within this share of the mean: equal spheres would order along the
walls."""
GRAIN = Material(2500.0, 4.0e6, 0.25)
"""Glass, but soft: under the beds here, at 1 kPa, the overlap is half a per cent of the grain."""


def make_sim(
    walls, pair, sides, diameter, rolling="none", grain=GRAIN, spread=SPREAD, down=(0.0, 0.0, -1.0)
):
    """Simulation of a material under gravity.

    pair: ContactParameters among grains; sides: those with each material of the walls, by name;
    diameter: mean [m]."""
    return Simulation(
        {"grain": grain} | dict.fromkeys(sides, grain),
        {("grain", "grain"): pair} | {("grain", name): side for name, side in sides.items()},
        laws=Laws(rolling=rolling),
        time_step=0.4 * rayleigh(0.5 * (1 - spread) * diameter, grain),
        gravity=GRAVITY * np.array(down),
        walls=walls,
    )


def sites_in_circle(radius, diameter, rng):
    """Places (n, 2) [m] within a circle where grains can be made without touching, in random
    order."""
    largest = 0.5 * diameter * (1 + SPREAD)
    line = np.arange(-radius + largest, radius, 2.1 * largest)
    x, y = (v.ravel() for v in np.meshgrid(line, line, indexing="ij"))
    inside = np.hypot(x, y) < radius - 1.05 * largest
    return rng.permutation(np.column_stack([x[inside], y[inside]]))


def sites_in_rectangle(low, high, diameter, rng):
    """Places (n, 2) [m] within low..high (2,) [m] where grains can be made without touching, in
    random order."""
    largest = 0.5 * diameter * (1 + SPREAD)
    lines = [
        np.arange(a + 1.05 * largest, b - largest, 2.1 * largest)
        for a, b in zip(low, high, strict=True)
    ]
    x, y = (v.ravel() for v in np.meshgrid(*lines, indexing="ij"))
    return rng.permutation(np.column_stack([x, y]))


def add_layers(sim, count, sites, bottom, diameter, rng):
    """Add `count` grains at the sites (n, 2) [m], layer on layer above the height `bottom` [m],
    thrown about so that no lattice stays."""
    radius = 0.5 * diameter * rng.uniform(1 - SPREAD, 1 + SPREAD, count)
    layer, place = np.divmod(np.arange(count), len(sites))
    z = bottom + diameter * (0.6 + 1.1 * (1 + SPREAD) * layer)
    speed = 1.5 * math.sqrt(GRAVITY * diameter)
    velocity = rng.uniform(-speed, speed, (count, 3))
    sim.add_particles(np.column_stack([sites[place], z]), radius, velocity=velocity)


def advance_for(sim, duration):
    """Advance by about `duration` [s]."""
    sim.advance(max(round(duration / sim.time_step), 1))


def settle(sim, limit=2.0):
    """Wait until the mean energy of motion is a thousandth of what lifts a grain by its radius;
    spins do not count, for without rolling resistance loose grains spin on. Fails when they do not
    rest within `limit` [s]."""
    start = sim.time
    while sim.time - start < limit:
        advance_for(sim, 0.02)
        energy = 0.5 * sim.mass @ (sim.velocity**2).sum(1)
        ratio = energy / (GRAVITY * sim.mass @ sim.radius)
        if sim.time - start > 0.05 and ratio < 1e-3:
            return
    raise AssertionError(f"the bed does not rest: energy ratio {ratio:.2g}")


def bulk_density(sim, radius, bottom, top):
    """Mass of the grains over volume in the core of a cylinder [kg/m3]; lengths [m]."""
    p = sim.position
    inside = (np.hypot(p[:, 0], p[:, 1]) < radius) & (p[:, 2] > bottom) & (p[:, 2] < top)
    return float(sim.mass[inside].sum()) / (math.pi * radius**2 * (top - bottom))
