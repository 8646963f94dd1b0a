"""The energy ledger closes under every law, with walls that move, free lids, bonded grains and air;
what it holds and dissipates is that of closed forms; and it tells a force that no contact made."""

import math

import numpy as np
import pytest
from ledger import Ledger

from dem.contact.registry import ContactParameters, Laws, Material
from dem.simulation import Air, Simulation
from dem.walls.builder import WallSet
from law_cases import alone, values
from scenes import make, rayleigh

RADIUS, G = 1e-3, 9.81
SOFT = Material(1210.0, 3e6, 0.25)
CLOSED = 1e-4
MASS = 4 / 3 * math.pi * RADIUS**3 * SOFT.density


def simulation(walls, laws, parameters=(), *, e=0.5, mu=0.5, mu_r=0.2, share=0.1, **more):
    contact = ContactParameters(e, mu, mu_r, **dict(parameters))
    scene = {"gravity": G, "overlap_limit": 0.5} | more
    step = share * rayleigh(RADIUS, SOFT)
    return make(contact, laws=laws, grain=SOFT, wall=SOFT, walls=walls, dt=step, **scene)


def cup(**motion):
    walls = WallSet().body("cup", material="wall", **motion)
    return walls.cylinder(4.5 * RADIUS, 0.0, 20 * RADIUS).disc(4.5 * RADIUS)


STIRRED = {"velocity": (0.02, 0.0, 0.05), "spin": (0.0, 0.0, 10.0)}


def thrown(sim, per_grain=1):
    """27 grains into the cup, each of `per_grain` spheres in a row."""
    rng, k = np.random.default_rng(2), np.arange(27)
    site = np.column_stack([k % 3 - 1, k // 3 % 3 - 1, k // 9]) * 2.1 * RADIUS
    site = site + [0.0, 0.0, 1.05 * RADIUS] + rng.uniform(-5e-5, 5e-5, site.shape)
    velocity = rng.uniform(-0.3, 0.3, site.shape)
    if per_grain == 1:
        sim.add_particles(site, RADIUS, velocity=velocity, spin=rng.uniform(-50, 50, site.shape))
        return
    along = np.linspace(-0.3, 0.3, per_grain)[:, None] * [RADIUS, 0.0, 0.0]
    sim.add_clusters(site[:, None] + along, 0.7 * RADIUS, velocity=velocity)


def followed(sim, steps=1000, look=100):
    """The ledger of a run, and the least that was dissipated between two looks over all [-]."""
    ledger, spent = Ledger(sim), [0.0]
    for _ in range(steps // look):
        ledger.advance(look)
        spent.append(ledger.energies.dissipated)
    return ledger, float(np.diff(spent).min()) / spent[-1]


@pytest.mark.parametrize(("name", "laws"), alone(), ids=[name for name, _ in alone()])
def test_the_ledger_closes_under_every_law_and_nothing_creates_energy(name, laws, record):
    sim = simulation(cup(**STIRRED), laws, values(laws))
    thrown(sim)
    ledger, least = followed(sim)
    record("energy", f"ledger's error, {name}", ledger.error, 0.0, CLOSED)
    assert least > -1e-6
    assert ledger.energies.walls > 0.05 * ledger.energies.dissipated


CASES = {
    "bonded grains": (Laws(), {"per_grain": 3}, None),
    "bonded grains, own spin": (Laws(rolling="constant_torque"), {"per_grain": 3}, None),
    "air": (Laws(drag="schiller_naumann"), {}, Air(1.2, 1.8e-5)),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_the_ledger_closes_with(case, record):
    laws, grains, air = CASES[case]
    sim = simulation(cup(**STIRRED), laws, air=air, precision="double")
    thrown(sim, **grains)
    ledger, least = followed(sim)
    record("energy", f"ledger's error, {case}", ledger.error, 0.0, CLOSED)
    assert least > -1e-6


@pytest.mark.slow
def test_the_ledger_closes_under_a_lid_that_falls_under_a_load(record):
    walls = cup()
    lid = {"mass": 5 * MASS, "axis": (0.0, 0.0, 1.0), "load": -20 * MASS * G, "drag": 2e-3}
    walls = walls.body("lid", material="wall", origin=(0.0, 0.0, 9 * RADIUS), free=lid)
    sim = simulation(walls.disc(4.4 * RADIUS), Laws(), precision="double")
    thrown(sim)
    ledger, least = followed(sim, 6000)
    record("energy", "ledger's error, free lid", ledger.error, 0.0, CLOSED)
    assert least > -1e-6
    assert sim.wall_origin("lid")[2] < 8 * RADIUS


def meeting(e, speed=0.5):
    """Two grains that meet head on, without gravity."""
    laws = Laws(rolling="none")
    sim = simulation(WallSet(), laws, e=e, mu=0.0, share=0.01, gravity=(0, 0, 0),
                     precision="double")  # fmt: skip
    sim.add_particles([[0, 0, -1.001 * RADIUS], [0, 0, 1.001 * RADIUS]], RADIUS,
                      velocity=[[0, 0, speed / 2], [0, 0, -speed / 2]])  # fmt: skip
    return sim, 0.25 * MASS * speed**2


@pytest.mark.slow
def test_a_contact_holds_all_the_energy_at_its_deepest_and_gives_it_back():
    sim, begin = meeting(1.0)
    ledger, held = Ledger(sim), []
    for _ in range(400):
        ledger.advance(5)
        held.append(ledger.energies.elastic)
    assert max(held) == pytest.approx(begin, rel=2e-3)
    assert held[-1] == 0.0
    assert abs(ledger.energies.dissipated) < 1e-3 * begin


@pytest.mark.slow
@pytest.mark.parametrize("e", [0.9, 0.5])
def test_an_impact_dissipates_by_its_restitution(e):
    sim, begin = meeting(e)
    ledger = Ledger(sim)
    ledger.advance(2500)
    assert sim.velocity[1, 2] > 0.0
    assert ledger.energies.dissipated == pytest.approx((1.0 - e * e) * begin, rel=5e-3)


@pytest.mark.slow
def test_a_push_that_no_contact_makes_is_told(monkeypatch):
    sim = simulation(cup(**STIRRED), Laws(), precision="double")
    thrown(sim)
    step = Simulation.advance

    def pushed(self, steps):
        step(self, steps)
        self.particles.kinetic[3, 0] += 1e-3

    monkeypatch.setattr(Simulation, "advance", pushed)
    ledger, _ = followed(sim, 500)
    assert abs(ledger.error) > 10 * CLOSED
