"""Sliding and rolling on planes, both kinds of rolling resistance, and the incline."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from dem.simulation import Air
from scenes import (
    GRAVITY,
    SALT,
    ContactParameters,
    Laws,
    floor,
    make,
    mass_of,
    pair_impact,
)

R = 1e-3
DT = 5e-6


def resting(contact, *, laws=None, angle=0.0, velocity=0.0, spin=0.0, walls=None, **more):
    """A sphere that rests on a plane; angle [rad]: gravity is turned instead of the plane, downhill
    is +x."""
    sim = make(contact, laws=laws, walls=walls or floor(), dt=DT, **more)
    sim.gravity[:] = (GRAVITY * math.sin(angle), 0.0, -GRAVITY * math.cos(angle))
    young = sim.properties[-1].young
    mass = 4 / 3 * math.pi * R**3 * SALT.density
    sag = (mass * GRAVITY * math.cos(angle) / (4 / 3 * young * math.sqrt(R))) ** (2 / 3)
    sim.add_particles([[0, 0, R - sag]], R, velocity=[[velocity, 0, 0]], spin=[[0, spin, 0]])
    return sim


@pytest.mark.parametrize("precision", ["mixed", "double"])
def test_slide_to_roll(record, precision):
    mu, u0 = 0.3, 0.2
    sim = resting(ContactParameters(0.5, mu), velocity=u0, precision=precision)
    expected = 2 * u0 / (7 * mu * GRAVITY)
    while sim.velocity[0, 0] > R * sim.spin[0, 1] * 1.0005:
        sim.advance(1)
    # the dashpot rounds the corner: the last half per cent of the slip decays over a contact time
    record("slide to roll", f"time, {precision}", sim.time, expected, 0.02 * expected, "s")
    sim.advance(500)
    record(
        "slide to roll",
        f"final speed, {precision}",
        sim.velocity[0, 0],
        5 * u0 / 7,
        2e-3 * u0,
        "m/s",
    )


@pytest.mark.parametrize("law", ["constant_torque", "constant_torque_relative", "elastic_plastic"])
def test_rolling_decay(record, law):
    """Constant torque on a rolling sphere, for as long as friction can hand it over: a = -(5/7)
    mu_r g; so does the elastic-plastic spring once it is full, and then swings to rest."""
    mu_r, u0 = 0.05, 0.1
    contact = ContactParameters(0.5, 0.8, mu_r)
    sim = resting(contact, laws=Laws(rolling=law), velocity=u0, spin=u0 / R)
    sim.advance(4000)
    t = sim.time
    expected = u0 - 5 / 7 * mu_r * GRAVITY * t
    record(
        "rolling decay",
        f"speed after {t * 1e3:.0f} ms, {law}",
        sim.velocity[0, 0],
        expected,
        0.01 * u0,
        "m/s",
    )
    sim.advance(round(1.2 * u0 / (5 / 7 * mu_r * GRAVITY) / DT))
    record("rolling decay", f"spin at the end, {law}", sim.spin[0, 1], 0.0, 0.2, "rad/s")


@pytest.mark.parametrize("law", ["constant_torque", "constant_torque_relative", "elastic_plastic"])
def test_incline_at_rest_where_rolling_friction_holds(record, law):
    """mu_r >= tan th: the sphere stays; EPSD and the own-spin torque hold it, the relative torque
    creeps within a step."""
    angle, mu_r = math.radians(10), 0.25
    sim = resting(ContactParameters(0.5, 0.9, mu_r), laws=Laws(rolling=law), angle=angle)
    sim.advance(40000)
    x0 = sim.position[0, 0]
    sim.advance(40000)
    # the relative torque only answers a spin that is there, so it lets the sphere creep: 20 um/s,
    # and only that law
    tolerance = 1e-5 if law == "constant_torque_relative" else 1e-7
    record(
        "incline", f"creep in 0.2 s at rest, {law}", sim.position[0, 0] - x0, 0.0, tolerance, "m"
    )


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.1, 0.3])
def test_a_rocking_sphere_has_the_stated_damping_ratio(record, ratio):
    """A sphere that rocks on a plane without slip turns about the contact point: (7/5) m R^2 th'' =
    -C th' - k_r th. Of two swings in one direction, one after the other, the second is exp(-2 pi
    eta/sqrt(1 - eta^2)) of the first."""
    # so soft a rolling spring that the tangential one holds the contact point in its place
    contact = ContactParameters(0.5, 50.0, 0.1, rolling_damping=ratio)
    sim = resting(contact, laws=Laws(rolling="elastic_plastic"), precision="double")
    sim.gravity[0] = 0.01 * GRAVITY  # a push that leaves the rolling spring far from its limit
    sim.advance(60000)
    sim.gravity[0] = 0.0
    speeds = []
    for _ in range(4000):
        sim.advance(5)
        speeds.append(sim.spin[0, 1])
    speeds = np.array(speeds)
    inner = speeds[1:-1]
    peaks = inner[(inner < speeds[:-2]) & (inner < speeds[2:]) & (inner < 0)]
    decrement = math.log(peaks[0] / peaks[1])
    measured = decrement / math.hypot(decrement, 2 * math.pi)
    # the dashpot sees the spin of half a step before
    record("rolling spring", "damping ratio of a rocking sphere", measured, ratio, 0.02 * ratio)


def test_a_stiff_rolling_spring_does_not_tremble(record):
    """mu_r 5: the spring is fifty times as stiff as that of the contact; a sphere that is pushed
    and a small heap of grains on each other still come to rest."""
    contact = ContactParameters(0.5, 0.5, 5.0)
    laws = Laws(rolling="elastic_plastic", torsion="marshall")
    sim = make(contact, laws=laws, walls=floor(), dt=DT, gravity=GRAVITY)
    base = np.array([(x, y, 0.999) for x in (0.0, 2.0, 4.0) for y in (0.0, 2.0, 4.0)])
    upper = np.array([(x, y, 2.42) for x in (1.0, 3.0) for y in (1.0, 3.0)])
    sim.add_particles(R * np.vstack([base, upper, [[2, 2, 3.85]]]), R, velocity=[0.02, 0.01, 0])
    sim.advance(60000)
    energy = sim.kinetic_energy() / (sim.mass.sum() * GRAVITY * R)
    record("rolling spring", "energy of a small heap over m g R, mu_r = 5", energy, 0.0, 1e-7)


@pytest.mark.parametrize("mu", [0.3, 0.7])
def test_sliding_threshold_of_a_body_that_cannot_roll(record, mu):
    """Four bonded grains slip at tan th = mu: they stay 0.3 degrees below and go 0.3 degrees
    above."""
    moved = {}
    for side in (-0.3, 0.3):
        angle = math.atan(mu) + math.radians(side)
        sim = make(ContactParameters(0.5, mu), walls=floor(), dt=DT)
        sim.gravity[:] = (0.0, 0.0, -GRAVITY)
        corner = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * R
        sim.add_clusters([np.column_stack([corner, np.full(4, R)])], R)
        sim.advance(2000)
        # turned slowly, so that the tangential springs take up the load without a jerk
        for k in range(100):
            a = angle * (k + 1) / 100
            sim.gravity[:] = (GRAVITY * math.sin(a), 0.0, -GRAVITY * math.cos(a))
            sim.advance(100)
        x0 = sim.clusters.position[0, 0]
        sim.advance(10000)
        moved[side] = sim.clusters.position[0, 0] - x0
    gone = 0.5 * GRAVITY * (math.sin(angle) - mu * math.cos(angle)) * (10000 * DT) ** 2
    record("sliding threshold", f"path 0.3 deg below, mu = {mu}", moved[-0.3], 0.0, 1e-6, "m")
    record(
        "sliding threshold", f"path 0.3 deg above, mu = {mu}", moved[0.3], gone, 0.15 * gone, "m"
    )


ROLLING_LAWS = ["constant_torque", "constant_torque_relative", "elastic_plastic"]
# spin [rad/s] at which the rolling spring of the elastic-plastic law slides from the first touch on
FAST = 5e3


@pytest.mark.parametrize("law", ROLLING_LAWS)
@pytest.mark.parametrize("ratio", [1.0, 3.0])
def test_rolling_torque_of_a_pair(record, law, ratio):
    """Frictionless elastic impact of spheres that roll on each other: each spin loses mu_r arm
    times the normal impulse over I; the arm is the own radius in the own-spin law and R* in the
    others."""
    mu_r, speed, radii = 0.1, 0.5, np.array([R, ratio * R])
    sim = pair_impact(
        ContactParameters(1.0, 0.0, mu_r),
        speed,
        radii=tuple(radii),
        laws=Laws(rolling=law),
        steps=400,
        spin=(FAST, -FAST),
    )
    m = mass_of(radii, SALT)
    impulse = 2 * m.prod() / m.sum() * speed
    arm = radii if law == "constant_torque" else np.full(2, radii.prod() / radii.sum())
    lost = FAST - np.abs(sim.spin[:, 2])
    expected = mu_r * arm * impulse / (0.4 * m * radii**2)
    # a sum of 400 forces for the time integral; the elastic-plastic law lags by the turn that loads
    # its spring
    for name, value, reference in zip(("first", "second"), lost, expected, strict=True):
        what = f"spin lost in an impact, {law}, sizes 1:{ratio:g}, {name}"
        record("rolling torque", what, value, reference, 0.02 * reference, "rad/s")


def test_terminal_speed(record):
    """Free fall in air: weight equals the Schiller-Naumann drag."""
    rho, viscosity, d = 1.2, 1.8e-5, 0.2e-3
    sim = make(
        ContactParameters(0.5, 0.0),
        dt=1e-4,
        gravity=GRAVITY,
        air=Air(rho, viscosity),
    )
    sim.add_particles([[0, 0, 0]], d / 2)
    sim.advance(10000)
    weight = math.pi / 6 * d**3 * SALT.density * GRAVITY

    def excess(v):
        re = rho * v * d / viscosity
        return 3 * math.pi * viscosity * d * v * (1 + 0.15 * re**0.687) - weight

    expected = brentq(excess, 1e-3, 10)
    record(
        "air drag",
        "terminal speed of 0.2 mm",
        -sim.velocity[0, 2],
        expected,
        1e-3 * expected,
        "m/s",
        "Schiller and Naumann (1933)",
    )
