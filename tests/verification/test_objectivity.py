"""A contact that turns as a whole is the same contact, and a wall is one however many bodies it is
made of."""

import math

import numpy as np
import pytest

from dem.contact.registry import ContactParameters, Laws, Material, pair_properties
from dem.walls.builder import WallSet
from scenes import led, make, rayleigh

RADIUS, G = 1e-3, 9.81
SOFT = Material(1210.0, 3e6, 0.25)
LAWS = Laws(rolling="elastic_plastic", torsion="marshall")


def simulation(walls, *, e=0.5, mu=0.8, rolling=0.2, laws=LAWS, share=0.2, **more):
    contact, scene = ContactParameters(e, mu, rolling), {"gravity": G, "overlap_limit": 0.2} | more
    step = share * rayleigh(RADIUS, SOFT)
    return make(contact, laws=laws, grain=SOFT, walls=walls, dt=step, **scene)


def table(rate):
    return WallSet().body("table", material="wall", spin=(0.0, 0.0, rate)).disc(0.02)


@pytest.mark.parametrize("rate", [10.0, 30.0])
def test_a_grain_at_rest_on_a_turntable_stays(rate, record):
    """A load that turns with the table, as a tilt does, must not move the grain in its frame."""
    sim = simulation(table(rate))
    sim.add_particles([[0.0, 0.0, RADIUS - 3e-7]], RADIUS, spin=[[0.0, 0.0, rate]])
    tilt = math.atan(0.15)

    def go(steps):
        for _ in range(0, steps, 10):
            a = tilt * min(1.0, sim.time / 0.05)
            along = (math.cos(rate * sim.time), math.sin(rate * sim.time))
            sim.model.gravity[:] = (
                G * math.sin(a) * along[0], G * math.sin(a) * along[1], -G * math.cos(a)
            )  # fmt: skip
            sim.advance(10)

    def place():
        return (sim.wall_state.rotation[0].T @ sim.position[0])[:2]

    go(round(0.1 / sim.time_step))
    turn = round(2.0 * math.pi / rate / sim.time_step)
    before = place()
    go(turn)
    creep = float(np.linalg.norm(place() - before)) / RADIUS
    record("turning contacts", f"creep in a turn at {rate:g} rad/s", creep, 0.0, 1e-5, "R")


RING = 5.2 * RADIUS  # of the vessel


def bed_in_a_vessel(precision):
    """60 grains that fell into a vessel and rest."""
    walls = WallSet().body("vessel", material="wall").cylinder(RING, 0.0, 40 * RADIUS).disc(RING)
    sim = simulation(walls, mu=0.6, share=0.3, precision=precision)
    line = np.array([-3.2, -1.05, 1.1, 3.3])
    layer = np.array([(a, b) for a in line for b in line if math.hypot(a, b) < 4.1])
    k = np.arange(60)
    site = np.column_stack([layer[k % len(layer)], 1.2 + 2.3 * (k // len(layer))]) * RADIUS
    sim.add_particles(site, RADIUS, velocity=np.random.default_rng(1).normal(0.0, 0.05, (60, 3)))
    sim.advance(round(0.5 / sim.time_step))
    return sim


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "precision"), [(10.0, "mixed"), (3.0, "mixed"), (10.0, "double")])
def test_a_bed_that_turns_with_its_drum_is_unchanged_after_ten_turns(rate, precision, record):
    """Grains beside the axis turn about it, and their contacts with them. In the frame of a drum
    that turns about the vertical gravity and the centrifugal force are constant."""
    sim = bed_in_a_vessel(precision)

    def places():
        return sim.position @ sim.wall_state.rotation[0]

    sim.move_wall("vessel", spin=(0.0, 0.0, rate))
    sim.advance(round(1.5 / sim.time_step))  # the bed takes up the spin
    before = places()
    turn = round(2.0 * math.pi / rate / sim.time_step)
    sim.advance(10 * turn)
    moved = float(np.linalg.norm(places() - before, axis=1).max()) / RADIUS
    what = f"a bed in its drum at {rate:g} rad/s, {precision}: largest move in ten turns, a turn"
    record("turning contacts", what, moved / 10.0, 0.0, 1e-5, "R")


def test_a_pair_s_spring_turns_with_it():
    """Two grains pressed and sheared, then spun alike about their normal: in the turned frame the
    spring is what it was."""
    p = pair_properties(LAWS, SOFT, SOFT, ContactParameters(0.5, 0.8, 0.2))
    steps, dt = 3000, 1e-5
    held = np.zeros((steps + 1, 4))
    held[:, 0] = 2e-5

    def history(steps, turns, begun):
        about = 2.0 * math.pi * turns / (steps * dt)
        return led(LAWS.codes(), p, dt, held[: steps + 1], 5e-4, 1e-3, 1e-13, about, begun)[1]

    start = history(1, 0.0, (1e-5, 0.0, 0.0, 0.0, 1e-9, 0.0, 1e-4, 0.0, 0.0))
    quarter, whole = history(steps // 4, 0.25, start), history(steps, 1.0, start)
    assert quarter[1] == pytest.approx(start[0], rel=1e-4)
    assert quarter[3] == pytest.approx(-start[4], rel=1e-4)
    assert whole[0] == pytest.approx(start[0], rel=1e-4)
    assert whole[4] == pytest.approx(start[4], rel=1e-4)


def rebound(walls, place, asked=0.5):
    sim = simulation(
        walls, e=asked, mu=0.0, laws=Laws(rolling="none"), share=0.01, gravity=(0, 0, 0)
    )
    sim.add_particles([[*place, 1.001 * RADIUS]], RADIUS, velocity=[[0.0, 0.0, -1.0]])
    sim.advance(round(4e-4 / sim.time_step))
    assert sim.position[0, 2] > RADIUS
    return float(sim.velocity[0, 2])


def halves(*names):
    walls = WallSet()
    for name, side in zip(names, (-1.0, 1.0), strict=True):
        walls = walls.body(name, material="wall")
        walls = walls.rectangle((side * 0.05, 0.0, 0.0), (0.05, 0.0, 0.0), (0.0, 0.05, 0.0))
    return walls


@pytest.mark.parametrize("across", [0.0, 0.3, -0.7])
def test_two_bodies_in_one_plane_act_as_one(across, record):
    alone = WallSet().body("a", material="wall").rectangle((0, 0, 0), (0.1, 0, 0), (0, 0.05, 0))
    place = (across * 2e-4, 0.0)
    one, two = rebound(alone, place), rebound(halves("a", "b"), place)
    record("two bodies in one plane", f"rebound at {across:g} of a contact from the seam", two, one,
           1e-3, "", "one body")  # fmt: skip
    assert one == pytest.approx(0.5, abs=5e-3)
