"""Vanes of the ring shear cell: one grain at a face, an edge and a joint by closed forms, and the
balances of many grains.

Another code's cell can hold as much as ours only if each of these is right.
"""

import math

import numpy as np
import pytest

from dem.experiments import shear_ring
from dem.spec import parse_spec
from scenes import GRAVITY, SALT, ContactParameters, effective, make, mass_of
from small_heap import RUN

R, DT = 1e-3, 2e-6
INNER, OUTER, TOP = 7e-3, 13e-3, 10e-3
"""Radii of the ring and height of the lid [m]."""
SPEC = parse_spec(
    RUN | {"experiment": "shear", "particles": {"count": 1, "diameter_mm": 2e3 * R}, "geometry": {}}
)
PRECISIONS = pytest.mark.parametrize("precision", ["mixed", "double"])


def cell(contact, *, spin=0.0, lid=None, **more):
    """The ring's own walls without grains; the lid stands at TOP unless it has a `lid` mass [kg]
    and load [N]."""
    ring = object.__new__(shear_ring.Ring)
    ring.inner, ring.outer, ring.lid, ring.floor = INNER, OUTER, None, None
    walls = ring.build_walls(SPEC, R)
    sim = make(contact, walls=walls, dt=DT, **more)
    k, state = walls.index("lid"), sim.wall_state
    state.origin[k, 2] = TOP
    state.mass[k], state.load[k] = lid or (0.0, 0.0)
    sim.move_wall("trough", spin=(0.0, 0.0, spin))
    return sim


def about_axis(sim):
    """Angular momentum of all grains about the axis of the ring [N m s]."""
    x, v, m = sim.position, sim.velocity, sim.mass
    orbit = m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
    return float((orbit + 0.4 * m * sim.radius**2 * sim.spin[:, 2]).sum())


def twist(sim, *names):
    """Angular impulse of the grains on bodies, about the axis [N m s]."""
    return sum(sim.wall_angular_impulse(name)[2] for name in names)


@PRECISIONS
@pytest.mark.parametrize("rise", [-1.0, 0.0, 0.5, 0.8])
def test_a_vane_strikes_a_grain_with_its_own_speed(rise, precision, monkeypatch):
    """By its face and, `rise` radii above it, by its upper edge: the grain leaves with (1 + e)
    times the speed of the wall along the normal. Two contacts in place of one would give less: two
    dashpots with the stiffness of two springs restore 0.37 for 0.5."""
    monkeypatch.setattr(shear_ring, "VANES", 6)
    e, rate, arm = 0.5, 4.0, 10e-3
    up = max(rise, 0.0)
    across = math.sqrt(1.0 - up**2)
    sim = cell(ContactParameters(e, 0.0), spin=rate, precision=precision)
    # a hundredth of its radius away: the vane turns by a thousandth before they meet
    sim.add_particles([(arm, 1.01 * R * across, 2 * R + rise * R)], R)
    sim.advance(1000)
    speed = rate * arm * across
    wanted = (1 + e) * speed * np.array([0.0, across, up])
    assert sim.velocity[0] == pytest.approx(wanted, abs=0.02 * speed)
    assert twist(sim, "trough") == pytest.approx(-about_axis(sim), rel=1e-5)
    gained = sim.mass[0] * sim.velocity[0]
    assert sim.wall_impulse("trough") == pytest.approx(-gained, rel=1e-5, abs=1e-12)


@PRECISIONS
def test_a_joint_of_lid_and_vane_is_two_walls(precision):
    """A grain flies into the corner between them: both turn its speed round by e, once each."""
    e, speed = 0.5, 0.2
    sim = cell(ContactParameters(e, 0.0), precision=precision)
    sim.add_particles([(11e-3, 1.01 * R, TOP - 1.01 * R)], R, velocity=[(0.0, -speed, speed)])
    sim.advance(600)
    assert sim.velocity[0] == pytest.approx([0.0, e * speed, -e * speed], abs=0.01 * speed)
    assert twist(sim, "lid") == pytest.approx(-11e-3 * sim.mass[0] * (1 + e) * speed, rel=0.01)


@PRECISIONS
def test_a_grain_between_two_vanes_is_pressed_by_both(precision, monkeypatch):
    """Two Hertz contacts: along the radius twice the sine of half the angle, and no torque."""
    monkeypatch.setattr(shear_ring, "VANES", 36)
    half, overlap = math.pi / 36, 0.05 * R
    arm = (R - overlap) / math.sin(half)
    sim = cell(ContactParameters(0.5, 0.6), precision=precision)
    out = np.array([math.cos(half), math.sin(half), 0.0])
    sim.add_particles([arm * out + (0.0, 0.0, 1.5 * R)], R)
    sim.advance(1)
    young, _ = effective(*sim.materials.values())
    force = 4.0 / 3.0 * young * math.sqrt(R) * overlap**1.5
    wanted = -2.0 * force * math.sin(half) * out
    assert sim.wall_force("trough") == pytest.approx(wanted, abs=1e-3 * force)
    assert abs(twist(sim, "trough")) < 1e-4 * force * arm * sim.time_step


def crowd(sim, count, seed=1):
    """Four rings of `count` grains between the vanes of floor and lid, with random speeds."""
    rng, turn = np.random.default_rng(seed), 2.0 * math.pi * np.arange(count) / count
    for arm, high in ((8.6e-3, 3.6e-3), (11.4e-3, 3.6e-3), (8.6e-3, 6.0e-3), (11.4e-3, 6.0e-3)):
        at = np.column_stack([arm * np.cos(turn), arm * np.sin(turn), np.full(count, high)])
        sim.add_particles(at, R, velocity=rng.uniform(-0.3, 0.3, (count, 3)))


@PRECISIONS
def test_what_vanes_do_to_a_gas_is_the_work_of_their_torque(precision):
    """Neither friction nor loss: the energy of the grains grows by the trough's torque times its
    turn, and by nothing else. A push counted twice, or a wall's speed that is not omega times r,
    would be in one of the two alone."""
    rate = 40.0
    sim = cell(ContactParameters(1.0, 0.0), spin=rate, precision=precision)
    crowd(sim, 18)
    before = sim.kinetic_energy()
    sim.advance(15_000)
    gained, work = sim.kinetic_energy() - before, -rate * twist(sim, "trough")
    assert work > before  # the vanes have struck most grains
    assert gained == pytest.approx(work, rel=0.02)


@PRECISIONS
def test_torques_on_lid_and_trough_balance_what_the_grains_gain(precision):
    """Sheared between vanes under a load, with friction: angular momentum about the axis and
    momentum along it."""
    mass = 4 * 18 * mass_of(R, SALT)
    weight, load = mass * GRAVITY, -0.5
    contact = ContactParameters(0.5, 0.6)
    sim = cell(contact, spin=3.0, lid=(mass, load), gravity=GRAVITY, precision=precision)
    crowd(sim, 18)
    speed = (sim.mass * sim.velocity[:, 2]).sum()
    spun, begin = about_axis(sim), sim.steps
    sim.advance(30_000)
    both = twist(sim, "trough", "lid")
    assert abs(twist(sim, "lid")) > 100.0 * abs(both)  # the lid holds, and the sums are small
    assert both == pytest.approx(
        spun - about_axis(sim), rel=1e-3, abs=1e-5 * abs(twist(sim, "lid"))
    )
    lasted = (sim.steps - begin) * sim.time_step
    pressed = sim.wall_impulse("trough")[2] + sim.wall_impulse("lid")[2]
    gained = (sim.mass * sim.velocity[:, 2]).sum() - speed
    assert pressed == pytest.approx(-gained - weight * lasted, rel=1e-4)
