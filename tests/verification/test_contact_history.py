"""What a contact remembers: bridges and necks, torsion, and closed loops, which must not give
work."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dem.contact.registry import attraction_reach, pair_properties
from dem.kernel.simd import FIELDS
from dem.simulation import SkinPolicy
from law_cases import alone, values
from scenes import (
    GRAVITY,
    SALT,
    STEEL,
    ContactParameters,
    Laws,
    WallSet,
    effective,
    floor,
    led,
    make,
    mass_of,
    rotation,
)

R = 1e-3
TENSION, LIQUID, ANGLE = 0.07, 0.01, 0.3
WET = {"surface_tension": TENSION, "liquid_volume_fraction": LIQUID, "contact_angle": ANGLE}
BRIDGE = Laws(rolling="none", cohesion="liquid_bridge")
VOLUME = LIQUID * 4 / 3 * math.pi * R**3
RUPTURE = (1 + ANGLE / 2) * VOLUME ** (1 / 3)


def bridge_force(gap, harmonic):
    """Willett et al. (2000) at a gap [m]; harmonic: mean radius of the two surfaces, of a sphere on
    a flat 2 R [m]."""
    s = gap * math.sqrt(harmonic / VOLUME)
    return 2 * math.pi * harmonic * TENSION * math.cos(ANGLE) / (1 + 1.05 * s + 2.5 * s * s)


def parted(sim, speed=1.0):
    """(gap [m], pull [N]) of a held sphere drawn off what is below it at a constant speed [m/s],
    while it is pulled."""
    below, pulls = 2 * R if sim.n > 1 else R, []
    while True:
        sim.particles.kinetic[sim.row_of[-1] if len(sim.row_of) else -1, :3] = (0, 0, speed)
        gap = sim.position[-1, 2] - below
        sim.advance(1)
        pull = -sim.particles.force[sim.row_of[-1], 2]
        if gap > 1e-6 and pull == 0:
            return np.array(pulls)
        pulls.append((gap, pull))


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("base", [0.01, 0.3])
@pytest.mark.parametrize("other", ["wall", "grain"])
def test_a_bridge_has_the_stated_volume_and_does_not_know_the_skin(record, other, base, precision):
    walls = floor() if other == "wall" else WallSet()
    contact = ContactParameters(1.0, 0.0, **WET)
    sim = make(
        contact,
        laws=BRIDGE,
        walls=walls,
        dt=2e-7,
        precision=precision,
        skin=SkinPolicy(base, 1),
    )
    if other == "grain":
        sim.add_clusters([[[0, 0, 0]]], R, mass=[1e9], inertia=[np.eye(3)])  # does not move
    sim.add_particles([[0, 0, (1.0 if other == "wall" else 2.0) * R * 0.9999]], R)
    gap, pull = parted(sim).T
    harmonic = 2 * R if other == "wall" else R
    wanted = np.array([bridge_force(s, harmonic) for s in gap])
    name = f"{other}, skin {base:g}, {precision}"
    worst = np.abs(pull / wanted - 1)[gap > 0].max()
    record("liquid bridge", f"largest deviation of the pull, {name}", worst, 0.0, 1e-3, "")
    record("liquid bridge", f"gap at rupture, {name}", gap[-1], RUPTURE, 2 * sim.time_step, "m")


# --- symmetries of bridges and necks --------------------------------------------------------------

SETTINGS = settings(max_examples=6, deadline=None, derandomize=True)
STICKY = {
    "bridge": (BRIDGE, WET),
    "neck": (
        Laws(rolling="elastic_plastic", cohesion="jkr", torsion="marshall"),
        {"surface_energy": 0.05},
    ),
}
unit = st.floats(-1, 1)


def sticky_hit(law, *, turn=None, boost=(0, 0, 0), base=0.05):
    """A spinning grain thrown at a sticky floor and at a grain beside it; velocities (2, 3) [m/s]
    and spins [rad/s] afterwards, turned and boosted back. turn: (3, 3) orthogonal; the floor turns
    and moves along."""
    laws, extra = STICKY[law]
    q = np.eye(3) if turn is None else turn
    walls = WallSet().body("floor", material="wall", velocity=boost).plane((0, 0, 0), q @ (0, 0, 1))
    sim = make(
        ContactParameters(0.6, 0.4, 0.1, **extra),
        laws=laws,
        walls=walls,
        dt=1e-6,
        precision="double",
        skin=SkinPolicy(base, 20),
    )
    place = np.array([[0, 0, 1.02], [2.03, 0.1, 1.5]]) * R
    velocity = np.array([[0.1, 0.02, -0.25], [-0.2, 0.0, -0.1]])
    spin = np.array([[30.0, -80.0, 120.0], [0.0, 60.0, -40.0]])
    handed = np.linalg.det(q)
    sim.add_particles(place @ q.T, R, velocity=velocity @ q.T + boost, spin=handed * spin @ q.T)
    sim.advance(4000)
    return (sim.velocity - boost) @ q, handed * sim.spin @ q


@pytest.fixture(scope="module", params=list(STICKY))
def sticky(request):
    return request.param, sticky_hit(request.param)


@pytest.mark.slow
@SETTINGS
@given(
    angle=st.floats(-3, 3),
    axis=st.tuples(unit, unit, unit).filter(lambda a: np.linalg.norm(a) > 0.1),
    boost=st.tuples(unit, unit, unit),
    base=st.floats(0.005, 0.9),
)
def test_bridges_and_necks_know_neither_direction_frame_nor_skin(sticky, angle, axis, boost, base):
    law, (velocity, spin) = sticky
    turned, boost = rotation(angle, axis), tuple(3 * b for b in boost)
    for turn in (turned, turned @ np.diag([1.0, -1.0, 1.0])):
        found = sticky_hit(law, turn=turn, boost=boost, base=base)
        assert np.abs(found[0] - velocity).max() < 1e-6
        assert np.abs(found[1] - spin).max() < 1e-2


# --- torsion --------------------------------------------------------------------------------------

TOP = Laws(rolling="none", torsion="marshall")


def test_a_spinning_top_comes_to_rest(record):
    """Full torque (2/3) a mu m g: the spin falls in a straight line, and then the spring and its
    dashpot stop it."""
    mu, spin, load = 0.5, 100.0, mass_of(R, SALT) * GRAVITY
    young = effective(SALT, STEEL)[0]
    radius = (0.75 * load * R / young) ** (1 / 3)
    sag = radius**2 / R
    sim = make(ContactParameters(0.5, mu), laws=TOP, walls=floor(), dt=2e-6, gravity=GRAVITY)
    sim.add_particles([[0, 0, R - sag]], R, spin=[[0, 0, spin]])
    fall = 2 / 3 * radius * mu * load / (0.4 * mass_of(R, SALT) * R**2)
    sim.advance(round(0.5 * spin / fall / sim.time_step))
    name = "spin about the normal"
    record(
        "torsion", f"{name}, half-way", sim.spin[0, 2], spin - fall * sim.time, 0.01 * spin, "rad/s"
    )
    sim.advance(round(0.7 * spin / fall / sim.time_step))
    # the full spring lets go of the stopped top, which swings: largest spin torque / sqrt(k I), k =
    # 4 G* a^3
    inertia = 0.4 * mass_of(R, SALT) * R**2
    swing = fall / math.sqrt(4 * effective(SALT, STEEL)[1] * radius**3 / inertia)
    assert swing < 0.02 * spin
    record("torsion", f"{name}, at rest", sim.spin[0, 2], 0.0, swing, "rad/s")


def test_torsion_of_a_pair_keeps_angular_momentum_and_turns_both(record):
    """Two pressed spheres that twist against each other: equal and opposite spins, and a swing with
    the period of the spring k = 4 G* a^3 on the reduced moment of inertia I/2."""
    from scipy.signal import argrelmax

    mass, shear = mass_of(R, SALT), effective(SALT)[1]
    overlap = 0.05 * R
    radius = math.sqrt(0.5 * R * overlap)
    period = 2 * math.pi * math.sqrt(0.2 * mass * R**2 / (4 * shear * radius**3))
    sim = make(ContactParameters(1.0, 5.0), laws=TOP, dt=period / 2000)
    sim.add_clusters(
        [[[0, 0, 0]], [[2 * R - overlap, 0, 0]]], R, mass=[1e6] * 2, inertia=[np.eye(3)] * 2
    )
    # heavy bodies stay where they are; their moment of inertia about the axis is that of the sphere
    sim.clusters.inertia[:] = 0.4 * mass * R**2
    sim.clusters.momentum[:] = [[0.4 * mass * R**2 * w, 0, 0] for w in (1.0, -1.0)]
    spins = []
    for _ in range(250):
        sim.advance(20)
        spins.append(sim.spin[:, 0])
    spins = np.array(spins)
    assert np.abs(spins.sum(axis=1)).max() < 1e-6
    peaks = argrelmax(spins[:, 0])[0]
    measured = 20 * sim.time_step * (peaks[-1] - peaks[0]) / (len(peaks) - 1)
    record("torsion", "period of a twist", measured, period, 0.01 * period, "s")


# --- closed loops ---------------------------------------------------------------------------------

LOOPS = {
    "neck": Laws(rolling="elastic_plastic", cohesion="jkr", torsion="marshall"),
    "friction and restitution as curves": Laws(
        rolling="none", damping="restitution_curve", friction="friction_curve"
    ),
    "linear": Laws(
        normal="linear", damping="linear", tangential="linear", rolling="elastic_plastic"
    ),
    "Walton-Braun": Laws(
        normal="walton_braun", damping="none", tangential="linear", rolling="elastic_plastic"
    ),
    "EEPA": Laws(normal="eepa", damping="none", rolling="elastic_plastic", torsion="marshall"),
} | dict(alone(rolling="none"))
"""Laws that meet in one contact, and each law alone."""


def work_of(codes, p, path):
    """Work [J] done by a contact on a sphere that is led along path (n, 4), see `led`."""
    forces, _ = led(codes, p, 1e-3, path, R, R, 1e-9, 0.0, (0.0,) * FIELDS)
    forces *= [-1.0, 1.0, 1.0, 1.0]
    return (0.5 * (forces[:-1] + forces[1:]) * np.diff(path, axis=0)[1:]).sum()


def corners_to_path(corners, steps=3000):
    """The polygon through corners (n, 4), each side in as many steps; the first point twice, for
    the force there."""
    sides = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(corners)]
    return np.vstack([corners[:1], corners[:1], *sides])


share = st.floats(0, 1)
corner = st.tuples(share, unit, unit, unit)


@pytest.mark.parametrize("name", list(LOOPS))
@settings(max_examples=10, deadline=None, derandomize=True)
@given(corners=st.lists(corner, min_size=2, max_size=5))
def test_a_closed_loop_gives_no_work(name, corners):
    """Press, shear, roll and twist along any polygon back to the start, without dashpots: what
    comes back is at most what went in. Margin: what a step of 1/3000 of a side leaves open, a
    thousandth of the energy that moves."""
    laws = LOOPS[name]
    e = 0.6 if laws.normal == "walton_braun" else 1.0  # there it is no dashpot
    p = pair_properties(
        laws,
        SALT,
        SALT,
        ContactParameters(e, 0.9, 0.3, **(values(laws) | {"rolling_damping": 0.0})),
    )
    codes = laws.codes()
    deep, gap = 0.2 * R, 0.95 * attraction_reach(laws, p, R)
    scale = np.array([deep + gap, 0.02 * R, 0.05, 0.05])
    points = np.array([(0.5, 0, 0, 0), *corners, (0.5, 0, 0, 0)]) * scale - [gap, 0, 0, 0]
    # a first turn makes the contact's memory, so that the loop may start anywhere
    path = corners_to_path(np.vstack([points, points[1:]]))
    total = work_of(codes, p, path)
    press = corners_to_path(np.array([points[0], [deep, 0, 0, 0]]))
    energy = abs(work_of(codes, p, press))
    assert total < 1e-3 * energy
