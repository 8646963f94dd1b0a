"""Laws as curves against closed forms: what an impact returns at each speed and size, how a block
slides."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator

from dem.materials import contact_parameters
from dem.spec import parse_spec
from scenes import (
    GRAVITY,
    SALT,
    ContactParameters,
    Laws,
    floor,
    make,
    mass_of,
    pair_impact,
    plane_impact,
)

R = 1e-3
BOUNCES = Laws(rolling="none", damping="restitution_curve")
SLIDES = Laws(rolling="none", friction="friction_curve")


def curve_of(key, shares, low, high, **powers):
    """Constants of a curve between two states, as `ContactParameters` names them."""
    named = {f"{key}_{k}": share for k, share in enumerate(shares, 1)}
    powers = {f"{key}_{state}_power": power for state, power in powers.items()}
    return named | {f"{key}_low": low, f"{key}_ratio": high / low} | powers


def through(values, low, high, state):
    """The curve by scipy: the polynomial through values (5,) at equal steps of the state's
    logarithm, held between the least and the largest, constant beyond."""
    at = np.linspace(math.log(low), math.log(high), len(values))
    log = np.clip(np.log(np.maximum(state, 1e-300)), at[0], at[-1])
    return np.clip(BarycentricInterpolator(at, values)(log), min(values), max(values))


def restitution_through(values, low, high, state):
    """Restitution: what runs along the curve is the damping ratio."""
    log = np.log(values)
    ratio = through(-log / np.hypot(log, math.pi), low, high, state)
    return np.exp(-math.pi * ratio / np.sqrt(1.0 - ratio**2))


FALLING = (0.9, 0.8, 0.75, 0.6, 0.4)
LOW, HIGH = 0.1, 2.0
SPEEDS = [0.02, 0.15, LOW * (HIGH / LOW) ** 0.25, 1.4, 4.0]


@pytest.mark.parametrize("other", ["wall", "grain"])
@pytest.mark.parametrize("speed", SPEEDS)
def test_an_impact_returns_the_curve_of_its_speed(record, other, speed):
    """At the five speeds the restitution given there, between them that of the curve, beyond them
    that of the ends; the contact's own restitution is 1."""
    contact = ContactParameters(1.0, 0.0, **curve_of("restitution_curve", FALLING, LOW, HIGH))
    options = {"steps": 400, "laws": BOUNCES}
    if other == "wall":
        returned = plane_impact(contact, speed, **options).velocity[0, 2] / speed
    else:
        velocity = pair_impact(contact, speed, **options).velocity[:, 0]
        returned = (velocity[1] - velocity[0]) / speed
    wanted = float(restitution_through(FALLING, LOW, HIGH, speed))
    name = f"restitution at {speed:.3g} m/s, {other}"
    record("laws as curves", name, returned, wanted, 3e-3)


@pytest.mark.parametrize(
    ("powers", "state"),
    [
        ({"speed": 0.0, "size": 1.0}, lambda v, d: d),
        ({"speed": 1.0, "size": 1.0}, lambda v, d: v * d),
        ({"speed": 2.0, "size": -1.0}, lambda v, d: v**2 / d),
    ],
    ids=["size", "speed times size", "speed squared over size"],
)
@pytest.mark.parametrize("radii", [(0.6e-3, 0.6e-3), (R, 3 * R)])
def test_restitution_of_size_and_speed_together(powers, state, radii):
    """d [mm] is the diameter of the ball on a wall, of two the harmonic mean."""
    shares, speed, low, high = (1.0, 0.95, 0.8, 0.6, 0.55), 0.5, 0.1, 5.0
    curve = curve_of("restitution_curve", shares, low, high, **powers)
    contact = ContactParameters(0.9, 0.0, **curve)
    values = 0.9 * np.array(shares)
    wall = plane_impact(contact, speed, radius=radii[1], laws=BOUNCES).velocity[0, 2] / speed
    wanted = restitution_through(values, low, high, state(speed, 2e3 * radii[1]))
    assert wall == pytest.approx(wanted, abs=3e-3)
    pair = pair_impact(contact, speed, radii=radii, steps=200, laws=BOUNCES).velocity[:, 0]
    mean = 2e3 * 2 * radii[0] * radii[1] / sum(radii)
    wanted = restitution_through(values, low, high, state(speed, mean))
    assert (pair[1] - pair[0]) / speed == pytest.approx(wanted, abs=3e-3)


def test_a_contact_held_by_a_bridge_forgets_the_speed_when_the_spheres_part():
    """A wet ball is thrown at the plane twice without leaving the bridge's reach: each time it
    returns the restitution of that speed."""
    bridge = Laws(rolling="none", damping="restitution_curve", cohesion="liquid_bridge")
    wet = {"surface_tension": 1e-9, "liquid_volume_fraction": 0.05}
    curve = curve_of("restitution_curve", FALLING, LOW, HIGH)
    sim = make(ContactParameters(1.0, 0.0, **curve, **wet), laws=bridge, walls=floor(), dt=2e-7)
    sim.add_particles([[0, 0, R + 1e-8]], R, velocity=[[0, 0, -1.0]])
    for speed in (1.0, 0.2):
        sim.particles.kinetic[0, 2] = -speed
        while sim.velocity[0, 2] < 0.0 or sim.position[0, 2] < R + 2e-5:
            sim.advance(10)
        wanted = float(restitution_through(FALLING, LOW, HIGH, speed))
        assert sim.velocity[0, 2] / speed == pytest.approx(wanted, abs=3e-3)


def block(contact, laws, gravity, speed):
    """Four bonded grains, far apart, that lie on a plane and slide at a speed [m/s]."""
    sim = make(contact, laws=laws, walls=floor(), dt=2e-6, gravity=gravity, precision="double")
    corner = 15 * R * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    sim.add_clusters([np.column_stack([corner, np.full(4, R)])], R)
    sim.advance(4000)  # the grains come to lie
    sim.clusters.velocity[0] = (speed, 0.0, 0.0)
    sim.advance(1)
    return sim


@pytest.mark.slow
def test_a_block_is_slowed_by_the_friction_of_its_speed():
    """du/dt = -mu(u) g, integrated by scipy."""
    shares, start = (1.0, 0.9, 0.7, 0.5, 0.45), 0.4
    curve = curve_of("friction_curve", shares, 0.01, 0.5, load=0.0, speed=1.0)
    sim = block(ContactParameters(0.3, 0.6, **curve), SLIDES, GRAVITY, start)
    sim.advance(2000)  # the springs have gone over to sliding
    begun, time = sim.clusters.velocity[0, 0], sim.time
    mu = lambda u: 0.6 * float(through(shares, 0.01, 0.5, u))  # noqa: E731
    for _ in range(4):
        sim.advance(4000)
        span = (0.0, sim.time - time)
        fall = solve_ivp(lambda _, u: [-mu(u[0]) * GRAVITY], span, [begun], rtol=1e-8)
        slowed = begun - fall.y[0, -1]
        assert begun - sim.clusters.velocity[0, 0] == pytest.approx(slowed, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("heavier", [0.3, 2.0, 4.0, 30.0])
def test_friction_falls_with_the_load_of_each_grain(heavier):
    """A block decelerates by mu(F) times gravity, F the load of one of its grains [N]."""
    shares, weight = (1.2, 1.0, 0.9, 0.5, 0.4), mass_of(R, SALT) * GRAVITY
    low, high = weight, 10 * weight
    contact = ContactParameters(0.3, 0.5, **curve_of("friction_curve", shares, low, high))
    sim = block(contact, SLIDES, heavier * GRAVITY, 1.0)
    sim.advance(1000)
    before, time = sim.clusters.velocity[0, 0], sim.time
    sim.advance(4000)
    slowing = (before - sim.clusters.velocity[0, 0]) / (sim.time - time)
    mu = 0.5 * float(through(shares, low, high, heavier * weight))
    # the foremost grains bear a little more than the last
    assert slowing == pytest.approx(mu * heavier * GRAVITY, rel=5e-3)


def test_grain_on_grain_and_grain_on_wall_have_curves_of_their_own():
    constants = {"friction_curve_low": 0.001, "friction_curve_ratio": 10, "friction_curve_2": 0.5}
    spec = {
        "experiment": "heap",
        "laws": {"friction": "friction_curve"},
        "law_parameters": constants | {"wall_friction_curve_2": 0.8},
    }
    found = contact_parameters(parse_spec(spec))
    assert found["particle", "particle"].friction_curve_2 == 0.5
    assert found["particle", "wall"].friction_curve_2 == 0.8
    assert found["particle", "wall"].friction_curve_1 == 1.0


def oblique(laws, precision, **constants):
    """Velocity and spin of a ball thrown at a plane, of two that hit each other, of one that
    rolls."""
    contact = ContactParameters(0.6, 0.3, 0.1, **constants)
    wall = plane_impact(contact, 0.5, 0.3, spin=(0, 40, 5), laws=laws, precision=precision)
    pair = pair_impact(contact, 0.5, laws=laws, spin=(200.0, 50.0), precision=precision)
    rolls = make(contact, laws=laws, walls=floor(), dt=4e-6, gravity=GRAVITY, precision=precision)
    rolls.add_particles([[0, 0, R]], R, velocity=[[0.1, 0, 0]], spin=[[0, 50, 0]])
    rolls.advance(3000)
    return np.concatenate([x for s in (wall, pair, rolls) for x in (s.velocity, s.spin)])


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize(
    ("key", "slot", "low"),
    [
        ("restitution_curve", "damping", 0.1),
        ("friction_curve", "friction", 1e-3),
    ],
)
def test_five_equal_shares_are_the_law_without_a_curve_to_the_bit(key, slot, low, precision):
    curve = curve_of(key, [1.0] * 5, low, 10 * low)
    plain = oblique(Laws(), precision)
    assert np.array_equal(oblique(Laws(**{slot: key}), precision, **curve), plain)
    curve[f"{key}_1"] = curve[f"{key}_5"] = 0.9
    assert not np.array_equal(oblique(Laws(**{slot: key}), precision, **curve), plain)
