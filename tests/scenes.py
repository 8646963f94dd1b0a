"""Small scenes: two spheres, or a sphere on a wall."""

import math

import numpy as np
from numba import njit

from dem.contact.model import contact_force
from dem.contact.registry import ContactParameters, Laws, Material
from dem.run import run
from dem.simulation import Simulation
from dem.spec import parse_spec
from dem.timescales import rayleigh_time
from dem.walls.builder import WallSet

GRAVITY = 9.81
SALT = Material(1210.0, 1.0e7, 0.25)
STEEL = Material(7800.0, 8.0e10, 0.30)


def from_young(young, poisson, density):
    """Material from Young's modulus [Pa]."""
    return Material(density, young / (2 * (1 + poisson)), poisson)


def make(contact, *, laws=None, grain=SALT, wall=STEEL, walls=None, dt=1e-6, gravity=0.0, **more):
    """Simulation with one contact law for all pairs; gravity [m/s2] points down, or is (3,)."""
    return Simulation(
        {"grain": grain, "wall": wall},
        {("grain", "grain"): contact, ("grain", "wall"): contact},
        laws=laws or Laws(rolling="none"),
        time_step=dt,
        gravity=(0.0, 0.0, -gravity) if np.ndim(gravity) == 0 else gravity,
        walls=walls,
        **({"overlap_limit": 0.9} | more),
    )


def rayleigh(radius, grain=SALT):
    """Rayleigh time of a grain of a material [s]."""
    return rayleigh_time(radius, grain.density, grain.shear_modulus, grain.poisson_ratio)


def body(name="w", **motion):
    """Walls of one body that is begun."""
    return WallSet().body(name, material="wall", **motion)


def both(contact):
    """Contacts of a run spec: the same among grains and with walls."""
    return {"particle_particle": contact, "particle_wall": contact}


def measure(folder, experiment, **parts):
    """Metrics of a run."""
    return run(parse_spec({"experiment": experiment} | parts), folder)["metrics"]


def floor():
    """A plane at z = 0."""
    return body("floor").plane((0, 0, 0), (0, 0, 1))


def rotation(angle, axis):
    """Matrix (3, 3) of a turn by an angle [rad] about an axis."""
    a = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def revolved(profile, sides, turn=0.0):
    """Vertices and triangles of a line through (radius, z), turned about z as a polygon of so many
    sides, whose first corner is `turn` sides from the x axis; none without area."""
    angle = 2 * math.pi * (np.arange(sides) + turn) / sides
    points = np.concatenate(
        [np.column_stack([r * np.cos(angle), r * np.sin(angle), 0 * angle + z]) for r, z in profile]
    )
    low = np.arange(sides * (len(profile) - 1)).reshape(-1, sides)
    after = np.roll(low, -1, axis=1)
    corners = [(low, after, after + sides), (low, after + sides, low + sides)]
    faces = np.concatenate([np.stack(three, axis=-1).reshape(-1, 3) for three in corners])
    a, b, c = np.moveaxis(points[faces], 1, 0)
    return points, faces[
        np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12 * np.ptp(points) ** 2
    ]


def effective(grain, other=None):
    """(E*, G*) of two materials [Pa]."""
    other = other or grain
    young = 1 / sum((1 - m.poisson_ratio**2) / m.young_modulus for m in (grain, other))
    shear = 1 / sum((2 - m.poisson_ratio) / m.shear_modulus for m in (grain, other))
    return young, shear


def contact_time(young, r_eff, m_eff, speed):
    """Duration of an elastic Hertz impact, 2.943 a_max / v [s]."""
    k = 4 / 3 * young * math.sqrt(r_eff)
    return 2.943 * (5 * m_eff * speed**2 / (4 * k)) ** 0.4 / speed


def mass_of(radius, material):
    """Mass of a sphere [kg]."""
    return 4 / 3 * math.pi * radius**3 * material.density


def pair_impact(
    contact,
    speed,
    *,
    radii=(1e-3, 1e-3),
    grain=SALT,
    steps=100,
    laws=None,
    offset=0.3,
    spin=(0.0, 0.0),
    **more,
):
    """Head-on impact of two spheres along x at relative `speed`, `steps` time steps a contact; runs
    until they part.

    offset: place of the first touch within a time step. Returns the simulation and the time step.
    """
    r1, r2 = radii
    young, _ = effective(grain)
    m1, m2 = mass_of(r1, grain), mass_of(r2, grain)
    dt = contact_time(young, r1 * r2 / (r1 + r2), m1 * m2 / (m1 + m2), speed) / steps
    sim = make(contact, laws=laws, grain=grain, dt=dt, **more)
    gap = offset * speed * dt
    sim.add_particles(
        [[0, 0, 0], [r1 + r2 + gap, 0, 0]],
        np.array([r1, r2]),
        velocity=[[speed / 2, 0, 0], [-speed / 2, 0, 0]],
        spin=[[0, 0, spin[0]], [0, 0, spin[1]]],
    )
    sim.advance(4 * steps)
    return sim


def plane_impact(
    contact,
    v_n,
    v_t=0.0,
    *,
    radius=1e-3,
    grain=SALT,
    wall=STEEL,
    steps=200,
    offset=0.3,
    laws=None,
    spin=(0, 0, 0),
    walls=None,
    **more,
):
    """Impact of a sphere on the floor with normal speed v_n and tangential velocity v_t along x;
    runs until it parts. offset: part of the first step before the touch."""
    young, _ = effective(grain, wall)
    dt = contact_time(young, radius, mass_of(radius, grain), v_n) / steps
    sim = make(contact, laws=laws, grain=grain, wall=wall, walls=walls or floor(), dt=dt, **more)
    sim.add_particles(
        [[0, 0, radius + offset * v_n * dt]], radius, velocity=[[v_t, 0, -v_n]], spin=[spin]
    )
    sim.advance(4 * steps)
    return sim


@njit(cache=True)
def led(codes, p, dt, path, r_eff, grain, inertia, about, history):
    """Forces (n - 1, 4) [N, N, N m, N m] of a contact without dashpots that is led along path (n,
    4): overlap [m], shear [m], roll and twist [rad]; and its last history. They are against the
    overlap, along the shear and about both axes. grain [m], about [rad/s]: see `contact_force`."""
    forces = np.zeros((len(path) - 1, 4))
    for k in range(1, len(path)):
        d = path[k] - path[k - 1]
        velocity, spin = (d[1] / dt, 0.0, -d[0] / dt), (d[2] / dt, 0.0, d[3] / dt)
        force, torque, _, history = contact_force(
            codes, p, dt, path[k, 0], (0.0, 0.0, 1.0), r_eff, grain, 0.0, inertia, velocity, spin,
            about, history,
        )  # fmt: skip
        forces[k - 1] = force[2], force[0], torque[0], torque[2]
    return forces, history


__all__ = ["ContactParameters", "Laws", "WallSet"]
