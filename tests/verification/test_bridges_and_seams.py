"""Bridges and necks across a gap: no dashpot acts where the spheres do not touch, and a seam of the
wall below changes nothing."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from scenes import SALT, ContactParameters, Laws, body, floor, make, mass_of

R = 1e-3
TENSION, LIQUID, STIFFNESS = 0.07, 0.01, 2000.0
VOLUME = LIQUID * 4 / 3 * math.pi * R**3
RUPTURE = VOLUME ** (1 / 3)
WET = {"surface_tension": TENSION, "liquid_volume_fraction": LIQUID}
LINEAR = {"normal": "linear", "damping": "linear", "tangential": "linear", "rolling": "none"}


def bridge_force(gap):
    """Pull [N] of the bridge on a flat wall at a gap [m], Willett et al. (2000)."""
    s = max(gap, 0.0) * math.sqrt(2 * R / VOLUME)
    return 2 * math.pi * 2 * R * TENSION / (1 + 1.05 * s + 2.5 * s * s)


def wet_rebound(restitution, speed):
    """Speed [m/s] at which the bridge breaks, of the equation of motion from the first touch on:
    spring and dashpot while the grain touches, the bridge up to its rupture."""
    mass, log = mass_of(R, SALT), math.log(restitution)
    dashpot = -2 * log / math.hypot(log, math.pi) * math.sqrt(STIFFNESS * mass)

    def motion(t, y):
        gap, v = y
        push = -STIFFNESS * gap - dashpot * v if gap < 0 else 0.0
        return [v, (push - bridge_force(gap)) / mass]

    def broken(t, y):
        return y[0] - RUPTURE

    broken.terminal, broken.direction = True, 1
    out = solve_ivp(
        motion, (0, 0.02), [0.0, -speed], events=broken, rtol=1e-9, atol=1e-12, max_step=1e-6
    )
    return out.y[1, -1]


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("restitution", [0.5, 0.9])
def test_a_wet_grain_on_a_linear_spring_rebounds_as_its_equation_says(
    record, restitution, precision
):
    speed, dt = 1.0, 2e-7
    contact = ContactParameters(restitution, 0.0, normal_stiffness=STIFFNESS, **WET)
    laws = Laws(cohesion="liquid_bridge", **LINEAR)
    sim = make(contact, laws=laws, walls=floor(), dt=dt, precision=precision)
    sim.add_particles([(0, 0, 1.0005 * R)], R, velocity=[(0, 0, -speed)])
    sim.advance(round(5e-3 / dt))
    assert sim.position[0, 2] > R + RUPTURE
    expected = wet_rebound(restitution, speed)
    record(
        "cohesion at a wall",
        f"wet rebound, linear, e = {restitution} and 1 m/s, {precision}: speed kept",
        sim.velocity[0, 2] / speed,
        expected / speed,
        0.02 * expected / speed,
        source="equation of motion",
    )


def undivided():
    return body().rectangle((0, 0, 0), (0.05, 0, 0), (0, 0.05, 0))


def halves():
    walls = body()
    for x in (-0.05, 0.05):
        walls.rectangle((x, 0, 0), (0.05, 0, 0), (0, 0.05, 0))
    return walls


def disc_in_ring():
    return body().disc(0.002).revolved(0.002, 0, 0.03, 0)


def triangles(n=40, edge=0.4e-3):
    """Some of its vertices and edges lie below the grain's path, or beside it by a little."""
    x = (np.arange(n + 1) - n / 2) * edge
    vertices = [(a + 0.13e-3, b, 0.0) for a in x for b in x]
    corners = []
    for i in range(n):
        for j in range(n):
            a = i * (n + 1) + j
            corners += [(a, a + 1, a + n + 1), (a + 1, a + n + 2, a + n + 1)]
    return body().mesh(vertices, corners)


HELD = {
    # name: what it adds to the contact, gap [m]
    "liquid_bridge": ({"surface_tension": 0.07, "liquid_volume_fraction": 0.02}, 0.1e-3),
    "jkr": ({"surface_energy": 1.0}, 1.2e-6),
}
DIVIDED = {"two rectangles": halves, "a disc in its ring": disc_in_ring, "a mesh": triangles}
SLIDE, STEP = 5e-3, 5e-6  # m, s
SAME = 1e-5


def pulls(cohesion, walls):
    """Pull [N] on a wall below a grain that touched it, was raised to a gap, and is carried along x
    at that gap."""
    extra, gap = HELD[cohesion]
    contact = ContactParameters(0.9, 0.5, 0.1, **extra)
    laws = Laws(cohesion=cohesion, rolling="elastic_plastic", torsion="marshall")
    sim = make(contact, laws=laws, walls=walls, dt=STEP)
    sim.add_particles([(-SLIDE / 2, 1e-4, 0.9995 * R)], R)
    out = []
    for speed, steps in ((0.0, 2), (0.2, round(SLIDE / 0.2 / STEP))):
        for _ in range(steps):
            sim.particles.kinetic[0, :6] = (speed, 0, 0, 0, 0, 0)
            sim.advance(1)
            sim.particles.position[0, 2] = R + gap
            if speed:
                out.append(sim.wall_force("w")[2])
    assert sim.position[0, 0] > 0.9 * SLIDE / 2
    return np.array(out)


@pytest.mark.parametrize("wall", DIVIDED)
@pytest.mark.parametrize("cohesion", HELD)
def test_a_bridge_over_a_gap_passes_a_seam_as_if_there_were_none(cohesion, wall):
    expected = pulls(cohesion, undivided())
    assert expected.min() > 0.0  # it holds all the way
    found = pulls(cohesion, DIVIDED[wall]())
    assert np.abs(found / expected - 1).max() < SAME
