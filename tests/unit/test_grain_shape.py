"""Grains of two bonded spheres: their mass and inertia, their motion, and what becomes of them in a
heap."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from dem.errors import MeasureError
from dem.experiments.setup import add_grains, build_simulation
from dem.grains.dumbbell import moments, sphere_radius
from dem.run import run as run_spec
from dem.spec import parse_spec
from dem.walls.builder import WallSet
from facts import refused

DENSITY = 1500.0
ELONGATIONS = [1.0, 1.05, 1.3, 1.7, 2.0]


def slices(a, elongation, weight):
    """Integral of weight(z, squared radius) over the slices of two spheres of radius a, centres on
    the z axis [m]."""
    h = (elongation - 1.0) * a

    def slice_at(z):
        return weight(z, max(a * a - (z - h) ** 2, a * a - (z + h) ** 2))

    return 2.0 * quad(slice_at, 0.0, h + a, epsabs=0.0, epsrel=1e-11)[0]


@pytest.mark.parametrize("elongation", ELONGATIONS)
def test_a_grain_keeps_the_volume_of_the_sphere(elongation):
    a = sphere_radius(1e-3, elongation)
    volume = slices(a, elongation, lambda z, squared: math.pi * squared)
    assert volume == pytest.approx(4.0 / 3.0 * math.pi * 1e-9, rel=1e-9)


@pytest.mark.parametrize("elongation", ELONGATIONS)
def test_moments_of_inertia_are_those_of_the_slices(elongation):
    a = 0.7e-3
    about = slices(a, elongation, lambda z, s: 0.5 * math.pi * DENSITY * s * s)
    across = slices(a, elongation, lambda z, s: math.pi * DENSITY * s * (0.25 * s + z * z))
    assert moments(a, elongation, DENSITY) == pytest.approx((about, across), rel=1e-9)


def elongated(elongation, **more):
    """Simulation of a heap's materials, double precision, weightless, and its spec."""
    spec = parse_spec(
        {
            "experiment": "heap",
            "particles": {"diameter_mm": 2.0, "elongation": elongation},
            "numerics": {"precision": "double"},
        }
        | more
    )
    return build_simulation(spec, WallSet(), gravity=(0.0, 0.0, 0.0)), spec


@pytest.mark.slow
def test_a_grain_in_the_engine_has_mass_and_inertia_of_the_body():
    sim, spec = elongated(1.6)
    add_grains(sim, spec, np.zeros((1, 3)), np.array([1e-3]), 0.0, np.random.default_rng(1))
    density = spec.materials.particle.density_kg_m3
    about, across = moments(sphere_radius(1e-3, 1.6), 1.6, density)
    mass = 4.0 / 3.0 * math.pi * 1e-9 * density
    assert sim.mass.sum() == pytest.approx(mass, rel=1e-12)
    assert sim.clusters.mass[0] == pytest.approx(mass, rel=1e-12)
    assert sim.clusters.inertia[0] == pytest.approx([about, across, across], rel=1e-9)
    axis = np.diff(sim.position, axis=0)[0]
    assert np.linalg.norm(axis) == pytest.approx(1.2 * sim.radius[0], rel=1e-6)
    own = sim.clusters.rotation[0, :, 0]
    assert abs(own @ axis) == pytest.approx(np.linalg.norm(axis), rel=1e-9)
    assert (sim.grain_count, list(sim.grain)) == (1, [0, 0])


def collision(e, mu, laws, angle, rayleigh_fraction=0.4):
    """Two elongated grains fly at each other off centre; momentum, angular momentum, energy before
    and after."""
    sim, spec = elongated(
        1.6,
        contacts={
            "particle_particle": {"restitution": e, "static_friction": mu, "rolling_friction": 0.1}
        },
        laws=laws,
        numerics={"precision": "double", "rayleigh_fraction": rayleigh_fraction},
    )
    position = np.array(
        [[0.0, 0.0, 0.0], [3e-3, 0.6e-3 * math.cos(angle), 0.6e-3 * math.sin(angle)]]
    )
    velocity = np.array([[0.4, 0.0, 0.0], [-0.4, 0.0, 0.0]])
    rng = np.random.default_rng([1, int(10 * angle)])
    add_grains(sim, spec, position, np.full(2, 1e-3), velocity, rng)

    def state():
        c = sim.clusters
        linear = c.mass[:, None] * c.velocity
        return (
            linear.sum(0),
            (np.cross(c.position, linear) + c.momentum).sum(0),
            sim.kinetic_energy(),
        )

    before = state()
    sim.advance(int(6e-3 / sim.time_step))
    assert np.abs(sim.clusters.velocity[0] - velocity[0]).max() > 0.01, (
        "they have missed each other"
    )
    assert not len(sim.contacts()[0]), "they have not parted"
    return before, state(), sim


@pytest.mark.slow
@pytest.mark.parametrize("rolling", ["none", "constant_torque_relative", "elastic_plastic"])
@pytest.mark.parametrize("angle", [0.3, 1.9, 4.1])
def test_two_free_grains_keep_momentum_and_create_no_energy(rolling, angle):
    before, after, sim = collision(0.6, 0.5, {"rolling": rolling}, angle)
    size = sim.clusters.mass[0] * 0.4
    assert np.abs(after[0] - before[0]).max() < 1e-12 * size
    assert np.abs(after[1] - before[1]).max() < 1e-9 * size * 1e-3
    assert after[2] < before[2]


def cloud(precision="mixed"):
    """Eight elongated grains and three spheres that fly at each other."""
    spec = parse_spec(
        {
            "experiment": "heap",
            "particles": {"diameter_mm": 2.0, "elongation": 1.5},
            "numerics": {"precision": precision},
        }
    )
    sim, rng = build_simulation(spec, WallSet(), gravity=(0.0, 0.0, 0.0)), np.random.default_rng(4)
    x = 2.8e-3 * np.array([(i, j, k) for i in range(2) for j in range(2) for k in range(3)])[:11]
    v = -40.0 * (x - x.mean(0)) + rng.normal(0, 0.02, x.shape)
    add_grains(sim, spec, x[:8], np.full(8, 1e-3), v[:8], rng)
    sim.add_particles(x[8:], 1e-3, velocity=v[8:])
    return sim


def test_a_grain_is_removed_whole_and_the_others_go_on():
    sim = cloud()
    sim.advance(100)
    gone, last, loose = sim.grain[4], sim.grain[15], sim.grain[18]
    # the second sphere of one grain, both of another, and a loose one
    tags = [gone + 1, last, last + 1, loose]
    stay = ~np.isin(sim.grain, [gone, last, loose])
    position, velocity, grain = sim.position[stay], sim.velocity[stay], sim.grain[stay]
    assert sim.remove(tags) == 3
    assert sim.grain_count == 8
    assert len(sim.clusters.mass) == 6
    assert np.array_equal(sim.position, position)
    assert np.array_equal(sim.grain, grain)
    sim.advance(1)
    assert sim.position == pytest.approx(position + velocity * sim.time_step, abs=1e-6)
    for first in range(0, 12, 2):
        pair = sim.position[first : first + 2]
        assert np.linalg.norm(pair[1] - pair[0]) == pytest.approx(sim.radius[first], rel=1e-6)
    assert sim.remove([gone]) == 0


def heap_of(elongation, rolling="constant_torque", **more):
    """Run spec of a heap of 700 soft grains of 4 mm."""
    friction = {"restitution": 0.3, "static_friction": 0.5, "rolling_friction": 0.2}
    return parse_spec(
        {
            "experiment": "heap",
            "materials": {"particle": {"shear_modulus_Pa": 1e6}},
            "contacts": {"particle_particle": friction, "particle_wall": friction},
            "laws": {"rolling": rolling},
            "particles": {"count": 700, "diameter_mm": 4.0, "elongation": elongation},
            "geometry": {"orifice_diameter_mm": 30, "generation_rate_per_s": 1400},
            "numerics": {"max_time_s": 3.0},
        }
        | more
    )


@pytest.mark.slow
def test_elongated_grains_stand_in_a_heap_where_spheres_roll_away(tmp_path):
    """Nothing but their shape holds them: the contacts do not resist rolling."""
    with refused(MeasureError, "no heap"):
        run_spec(heap_of(1.0, rolling="none"), tmp_path / "spheres")
    metrics = run_spec(heap_of(2.0, rolling="none"), tmp_path / "elongated")["metrics"]
    assert metrics["angle_of_repose_deg"] > 15.0
    assert metrics["height_mm"] > 3 * 4.0
