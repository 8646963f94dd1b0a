"""JKR from grains of two micrometres to two millimetres, soft and stiff, that hardly stick or stick
well: the pull-off force is 3 pi g R*, and no force is ever not a number."""

import math
from itertools import product

import numpy as np
import pytest

from dem.contact.registry import Material
from dem.simulation import Simulation
from dem.walls.builder import WallSet
from scenes import ContactParameters, Laws, effective, make, rayleigh

TOPIC = "JKR of small grains"
RADII = (1e-6, 1e-3)
MODULI = (1e7, 1e9)
ENERGIES = (1e-7, 1e-4, 0.05)
JKR = Laws(cohesion="jkr", rolling="none")
PLACES = 400
MARGIN = 0.03


def pair(radius, modulus, energy, precision):
    """Simulation, reduced radius [m] and E* [Pa] of two grains."""
    grain = Material(2500.0, modulus, 0.25)
    sim = make(
        ContactParameters(0.9, 0.3, surface_energy=energy),
        laws=JKR,
        grain=grain,
        dt=0.05 * rayleigh(radius, grain),
        precision=precision,
    )
    sim.add_particles([(0, 0, 0), (2.1 * radius, 0, 0)], radius)
    return sim, 0.5 * float(sim.radius[0]), effective(grain)[0]


def overlaps(r_eff, young, energy):
    """From the overlap of a contact that is pressed a little to beyond the least of the JKR curve.

    At the greatest pull a^3 = 9 pi g R*^2 / (4 E*) and the overlap is -a^2 / (3 R*); the least
    overlap is -(9/16)^(1/3) a^2 / R* = -0.83 a^2 / R*."""
    a = (2.25 * math.pi * energy * r_eff**2 / young) ** (1 / 3)
    return np.linspace(1.0, -1.0, PLACES) * a**2 / r_eff


def greatest_pull(radius, modulus, energy, precision):
    """Over 3 pi g R*: of two grains that are drawn apart by hand from place to place."""
    sim, r_eff, young = pair(radius, modulus, energy, precision)
    most = 0.0
    for overlap in overlaps(r_eff, young, energy):
        first, second = np.argsort(sim.particles.tag[:2])
        sim.particles.kinetic[:2, :6] = 0.0
        sim.particles.carry[:] = 0.0
        sim.particles.position[first, :3] = 0.0
        sim.particles.position[second, :3] = (4.0 * r_eff - overlap, 0, 0)
        sim.advance(1)
        v = sim.velocity[:, 0]
        assert np.isfinite(v).all()
        most = max(most, sim.mass[0] * v[0] / sim.time_step)
    return most / (3 * math.pi * energy * r_eff)


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("radius", RADII)
def test_the_greatest_pull_is_that_of_the_closed_form(record, radius, precision):
    cases = list(product(MODULI, ENERGIES))
    pulls = [greatest_pull(radius, *case, precision) for case in cases]
    what = f"radius {radius * 1e6:g} um, {precision}: greatest pull over 3 pi g R*"
    worst = max(pulls, key=lambda pull: abs(pull - 1))
    record(TOPIC, f"{what}, the worst of {len(cases)}", worst, 1.0, MARGIN)


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("radius", RADII)
def test_a_slow_hit_is_finite_and_gives_no_energy(radius, precision):
    """Two grains that meet, stick or part."""
    for modulus, energy in product(MODULI, ENERGIES):
        sim, r_eff, _ = pair(radius, modulus, energy, precision)
        speed = 1e-3 * math.sqrt(modulus / 2500.0)
        sim.particles.position[:2, 0] = np.array([0, 4.0 * r_eff * (1 + 1e-6)])[
            sim.particles.tag[:2]
        ]
        sim.particles.kinetic[:2, 0] = np.array([speed, -speed])[sim.particles.tag[:2]]
        fastest = 0.0
        for _ in range(100):
            sim.advance(40)
            assert np.isfinite(sim.velocity).all()
            apart = sim.position[1, 0] - sim.position[0, 0] > 4.0 * r_eff
            fastest = max(fastest, np.abs(sim.velocity).max() if apart else 0.0)
        assert fastest < 1.01 * speed


def test_cohesive_grains_bounce_on_a_wall_without_energy_as_hertz_has_it():
    grain, places = Material(1210.0, 1e7, 0.25), [(3e-3 * k, 0, 1.2e-3) for k in range(5)]
    pairs = {
        ("grain", "grain"): ContactParameters(0.5, 0.5, 0.1, surface_energy=0.03),
        ("grain", "wall"): ContactParameters(0.5, 0.5, 0.1),
    }
    made = []
    for laws in (Laws(cohesion="jkr"), Laws()):
        walls = WallSet().body("plate", material="wall").plane((0, 0, 0), (0, 0, 1))
        materials = {"grain": grain, "wall": Material(7800.0, 8e10, 0.3)}
        made.append(Simulation(materials, pairs, laws=laws, time_step=5e-6, walls=walls))
        made[-1].add_particles(places, 1e-3)
        made[-1].advance(2000)
    assert made[0].position == pytest.approx(made[1].position, rel=1e-6)
    assert made[0].wall_impulse("plate")[2] < 0.0  # they have met
