"""Concave seams of a body so shallow that both faces are felt at once: a valley of two rectangles,
a cylinder cut into facets, a hole whose rim is cut into edges.

Whatever stands for the seam, elastic contacts without friction take no energy and give none, and a
cylinder of many facets is the cylinder.
"""

import math

import numpy as np
import pytest

from scenes import (
    GRAVITY,
    SALT,
    STEEL,
    ContactParameters,
    Laws,
    body,
    contact_time,
    effective,
    make,
    mass_of,
    rayleigh,
    revolved,
)

TOPIC = "shallow concave seams"
R = 1e-3
ELASTIC = ContactParameters(1.0, 0.0)
APART = 3 * R  # between grains that do not meet
CONSERVED = 0.02
LIKE_THE_CYLINDER = 0.01  # of e
VALLEYS = (0.1, 1.0, 4.0)  # degrees, of each face


def step(speed, parts):
    """A share of the time that a grain of this speed [m/s] touches the wall [s]."""
    young, _ = effective(SALT, STEEL)
    return contact_time(young, R, mass_of(R, SALT), speed) / parts


def valley(slope, length):
    """Two rectangles that meet along y, each inclined by slope [rad]."""
    c, s, a = math.cos(slope), math.sin(slope), 0.01
    walls = body()
    for side in (1.0, -1.0):
        walls.rectangle((side * a * c, 0, a * s), (side * a * c, 0, a * s), (0, length, 0))
    return walls


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("angle", VALLEYS)
def test_an_elastic_hit_beside_a_shallow_valley_keeps_its_energy(record, angle, precision):
    """Grains that come straight down or at 27 degrees to it, from above the seam to where the
    further face is out of reach."""
    slope, speed, gap = math.radians(angle), 0.5, 0.02 * R
    hit = np.linspace(0, 2 * math.sin(slope), 14) * R
    x, v_x = (a.ravel() for a in np.meshgrid(hit, [-0.5 * speed, 0.0, 0.5 * speed]))
    y = APART * (np.arange(len(x)) - 0.5 * len(x))
    x = x - v_x * gap / speed
    z = (R + gap + np.abs(x) * math.sin(slope)) / math.cos(slope)
    v = np.column_stack([v_x, 0 * x, 0 * x - speed])
    dt = step(speed, 200)
    walls = valley(slope, APART * len(x))
    sim = make(ELASTIC, walls=walls, dt=dt, precision=precision)
    sim.add_particles(np.column_stack([x, y, z]), R, velocity=v)
    sim.advance(round(5 * gap / speed / dt) + 600)
    assert not sim.wall_force("w").any(), "a grain has not left"
    kept = (sim.velocity**2).sum(1) / (v**2).sum(1)
    what = f"elastic hits beside a valley of 180 - {2 * angle:g} degrees, {precision}"
    worst = kept[np.argmax(np.abs(kept - 1))]
    record(TOPIC, f"{what}: energy kept, the worst of {len(x)}", worst, 1.0, CONSERVED)


def cylinder(radius, n, half):
    """A cylinder about z, or n facets of two triangles with their vertices on it."""
    if n is None:
        return body().cylinder(radius, -half, half)
    return body().mesh(*revolved([(radius, -half), (radius, half)], n))


def restitutions(radius, n, v_t=0.0, places=21):
    """e of grains that hit the wall with 0.2 m/s evenly over a facet and with v_t [m/s] along it;
    over the normals of the smooth cylinder."""
    speed, count = 0.2, n or 36
    phi = 2 * math.pi * (np.linspace(0, 1, places) + 1e-4) / count
    out = np.column_stack([np.cos(phi), np.sin(phi), 0 * phi])
    along = np.column_stack([-out[:, 1], out[:, 0], 0 * phi])
    start = radius * math.cos(math.pi / count) - 1.005 * R  # clear of the middle of a facet
    z = APART * (np.arange(places) - 0.5 * places)
    dt = step(speed, 200)
    # as long as the last of them needs to arrive, and at most as long as the first to cross over
    way = 2 * (radius - R - start) / speed
    walls = cylinder(radius, n, APART * places)
    sim = make(ContactParameters(0.5, 0.0), walls=walls, dt=dt, precision="double")
    position = start * out + z[:, None] * [0, 0, 1]
    sim.add_particles(position, R, velocity=speed * out + v_t * along)
    sim.advance(round(way / dt) + 300)
    assert not sim.wall_force("w").any(), "a grain has not left"
    normal = sim.position * [1, 1, 0]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return -(sim.velocity * normal).sum(1) / speed


@pytest.mark.slow
@pytest.mark.parametrize("n", [36, 360])
@pytest.mark.parametrize("size", [3, 8])
def test_restitution_inside_a_faceted_cylinder_is_that_of_the_cylinder(record, size, n):
    """Straight outwards. With 36 facets a hit beside the middle of a facet is an oblique one: no
    hit may give more than stated there."""
    e = restitutions(size * R, n)
    what = f"cylinder of {n} facets and {size} R, hit straight outwards, restitution"
    if n < 144:
        record(TOPIC, f"{what}, least", e.min(), 0.5, None)
        assert e.max() < 0.5 + LIKE_THE_CYLINDER
        return
    worst = e[np.argmax(np.abs(e - 0.5))]
    record(TOPIC, f"{what}, worst of {len(e)}", worst, 0.5, LIKE_THE_CYLINDER)


def drum(n):
    """A closed drum of 10 R and as long, its flank smooth or of n facets."""
    walls = cylinder(10 * R, n, 5 * R).body("ends", material="wall")
    return walls.plane((0, 0, -5 * R), (0, 0, 1)).plane((0, 0, 5 * R), (0, 0, -1))


def energy_in_flight(sim):
    """Kinetic energy [J] at the next moment at which no grain touches anything."""
    for _ in range(2000):
        touching = any(sim.wall_force(name).any() for name in ("w", "ends"))
        if not touching and not len(sim.contacts()[0]):
            return sim.kinetic_energy()
        sim.advance(5)
    raise AssertionError("the grains never part")


def energy_kept(n, seed):
    """Energy over that at the start, the worst of every 5 ms, of ten grains of 0.7 m/s in a drum
    over 60 ms."""
    rng = np.random.default_rng(seed)
    k = np.arange(10)
    x = np.column_stack([k % 5 - 2, k // 5 * 2 - 1, 0 * k]) * [2.5 * R, 2.5 * R, 0]
    dt = step(1.0, 75)
    sim = make(ELASTIC, walls=drum(n), dt=dt, precision="mixed")
    sim.add_particles(x, R, velocity=rng.normal(size=x.shape) * 0.4)
    start, kept = sim.kinetic_energy(), []
    while sim.time < 0.06:
        sim.advance(round(5e-3 / dt))
        kept.append(energy_in_flight(sim) / start)
    return max(kept, key=lambda share: abs(share - 1))


@pytest.mark.slow
@pytest.mark.parametrize("n", [None, 144], ids=["smooth", "144 facets"])
def test_an_elastic_gas_in_a_faceted_drum_keeps_its_energy(record, n):
    gases = [energy_kept(n, seed) for seed in range(4)]
    worst = max(gases, key=lambda share: abs(share - 1))
    where = f"drum of {n} facets" if n else "smooth drum"
    record(
        TOPIC, f"elastic gas in a {where}: energy kept, the worst of four", worst, 1.0, CONSERVED
    )


def friction_on_the_way(n, steps=400):
    """(steps, 2) push outwards and friction [N] on the wall of a cylinder of 10 R, of a grain that
    is pressed 0.01 R into it and carried 0.04 R along it by hand, without turning; it sticks."""
    depth, way, arm, dt = 0.01 * R, 0.04 * R, 9.01 * R, 1e-6
    walls = cylinder(10 * R, n, 5 * R)
    sim = make(ContactParameters(1.0, 50.0), walls=walls, dt=dt, precision="double")
    sim.add_particles([(9 * R + depth, 0, 0)], R)
    out = []
    for path in np.linspace(-0.3 * way, 0.7 * way, steps):  # a seam is at 0
        phi = path / (10 * R)
        normal, along = (math.cos(phi), math.sin(phi), 0), (-math.sin(phi), math.cos(phi), 0)
        sim.particles.position[0, :3] = arm * np.array(normal)
        sim.particles.kinetic[0, :3] = way / steps / dt * np.array(along)
        sim.particles.kinetic[0, 3:6] = sim.particles.carry[0] = 0.0
        sim.advance(1)
        force = sim.wall_force("w")
        out.append((force @ normal, force @ along))
    return np.array(out)


@pytest.mark.slow
@pytest.mark.parametrize("n", [1440, 3600])
def test_friction_is_handed_on_over_the_seams_of_a_cylinder(record, n):
    """Over one seam and over two: the pressure stays, the spring goes on growing."""
    smooth, cut = friction_on_the_way(None), friction_on_the_way(n)
    off = np.abs(cut - smooth).max(axis=0) / smooth[-1]
    for what, value in zip(("pressure", "friction"), off, strict=True):
        name = f"carried along a cylinder of {n} facets: largest difference of {what}, over the end"
        record(TOPIC, name, value, 0.0, 0.02, source="analytic cylinder")


@pytest.mark.parametrize("precision", ["mixed", "double"])
def test_a_grain_that_plugs_a_faceted_hole_gains_no_energy(record, precision):
    """Dropped from 0.5 R on a hole of 0.5 R and 96 edges, at 0.4 of the Rayleigh time."""
    n, hole, drop = 96, 0.5 * R, 0.5 * R
    rest = math.sqrt(R**2 - (hole * math.cos(math.pi / n)) ** 2)
    sim = make(
        ContactParameters(0.5, 0.5, 0.1),
        laws=Laws(rolling="elastic_plastic", torsion="marshall"),
        walls=body().mesh(*revolved([(hole, 0), (3 * R, 0)], n, turn=0.3)),
        dt=0.4 * rayleigh(R),
        gravity=GRAVITY,
        precision=precision,
    )
    sim.add_particles([(0, 0, rest + drop)], R)
    weight, most = mass_of(R, SALT) * GRAVITY, 0.0
    for _ in range(1000):
        sim.advance(5)
        height = sim.position[0, 2] - rest
        most = max(most, sim.kinetic_energy() / (weight * drop) + height / drop)
    assert sim.wall_impulse("w")[2] < 0.0  # they have met
    what = f"grain dropped on a hole of {n} edges, {precision}: most energy over that at the start"
    record(TOPIC, what, max(most, 1.0), 1.0, 0.01)
