"""Bodies of walls: what moves freely keeps the motion it is given across its axis, and what turns a
grain is turned back. And a state taken in memory stays what it was."""

import numpy as np
import pytest

from dem.contact.registry import ContactParameters, Laws
from scenes import body, make

R = 1e-3
TYPE_C = {"rolling": "elastic_plastic", "torsion": "marshall"}
ROUGH = ContactParameters(0.5, 0.4, 0.1, surface_tension=0.07, liquid_volume_fraction=0.01)


def simulation(walls, *, laws=None, dt=4e-6, gravity=9.81, **more):
    return make(ROUGH, laws=laws or Laws(**TYPE_C), walls=walls, dt=dt, gravity=gravity, **more)


# --- free bodies ----------------------------------------------------------------------------------

ASKEW = np.array([1.0, 2.0, -2.0]) / 3.0
AXES = {"z": np.array([0.0, 0.0, 1.0]), "askew": ASKEW}


def free_plate(axis, velocity, load=0.0):
    free = {"mass": 0.01, "axis": tuple(axis), "load": load}
    return body(velocity=velocity, free=free).rectangle((0, 0, 0), (0.02, 0, 0), (0, 0.02, 0))


@pytest.mark.parametrize("axis", AXES)
def test_a_free_body_without_load_keeps_the_velocity_it_was_given(axis):
    first, second = np.array([0.1, 0.0, 0.0]), np.array([0.1, -0.05, 0.02])
    sim = simulation(free_plate(AXES[axis], first), gravity=0.0)
    sim.advance(2500)
    assert sim.wall_state.velocity[0] == pytest.approx(first, abs=1e-9)
    assert sim.wall_origin("w") == pytest.approx(first * sim.time, abs=1e-9)
    place, begun = sim.wall_origin("w"), sim.time
    sim.move_wall("w", velocity=second)
    sim.advance(2500)
    assert sim.wall_state.velocity[0] == pytest.approx(second, abs=1e-9)
    assert sim.wall_origin("w") == pytest.approx(place + second * (sim.time - begun), abs=1e-9)


@pytest.mark.parametrize("axis", AXES)
def test_a_loaded_body_is_accelerated_along_its_axis_alone(axis):
    velocity, load, mass = np.array([0.1, 0.0, 0.0]), 0.2, 0.01
    sim = simulation(free_plate(AXES[axis], velocity, load))
    sim.advance(5000)
    a = AXES[axis] * (load / mass - 9.81 * AXES[axis][2])
    t = sim.time
    assert sim.wall_state.velocity[0] == pytest.approx(velocity + a * t, abs=1e-6)
    # the path of a leapfrog from rest is half a step's longer
    assert sim.wall_origin("w") == pytest.approx(velocity * t + a * t**2 / 2, abs=1e-3 * t)


# --- a state kept in memory -----------------------------------------------------------------------

COHESIONS = ["none", "liquid_bridge"]


def crowd(cohesion, precision):
    """Touching grains and bonded ones on a plate that slides and turns below a lid that falls."""
    walls = body(velocity=(0.05, 0, 0), spin=(0, 0, 2.0))
    walls.rectangle((0, 0, 0), (0.03, 0, 0), (0, 0.03, 0))
    free = {"mass": 0.01, "axis": (0, 0, 1), "load": 0.0}
    walls.body("lid", material="wall", origin=(0, 0, 0.012), free=free).disc(0.02)
    laws = Laws(cohesion=cohesion, **TYPE_C)
    sim = simulation(walls, laws=laws, dt=5e-6, precision=precision)
    k = np.arange(27)
    x = np.column_stack([k % 3 - 1, k // 3 % 3 - 1, k // 9]) * 2.02 * R + [0, 0, 1.001 * R]
    sim.add_particles(x, R, velocity=np.random.default_rng(0).normal(size=x.shape) * 0.05)
    sim.add_clusters([[(0.008, 0, 1.5 * R), (0.009, 0.0002, 1.8 * R)]], R)
    return sim


def seen(sim):
    """Everything that can be seen of a simulation, in one row."""
    arrays = [sim.time, sim.position, sim.velocity, sim.spin, *sim.contacts()]
    arrays += [sim.clusters.rotation, sim.clusters.momentum]
    for name in ("w", "lid"):
        arrays += [sim.wall_origin(name), sim.wall_force(name), sim.wall_impulse(name)]
        arrays += [sim.wall_angular_impulse(name)]
    return np.concatenate([np.ravel(a).astype(float) for a in arrays])


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("cohesion", COHESIONS)
def test_a_state_kept_in_memory_gives_the_same_future_again(cohesion, precision):
    sim = crowd(cohesion, precision)
    sim.advance(1000)
    saved, then = sim.state_dict(), seen(sim)
    kept = {name: np.array(value) for name, value in saved.items()}
    sim.advance(2000)
    changed = [k for k in kept if not np.array_equal(saved[k], kept[k], equal_nan=True)]
    assert not changed, "what was kept does not change while the simulation goes on"
    future = seen(sim)
    assert np.linalg.norm(future[: len(then)] - then[: len(future)]) > 0.0
    for again in (sim, crowd(cohesion, precision)):  # itself, and one that was set up alike
        again.restore(saved)
        assert np.array_equal(seen(again), then)
        again.advance(2000)
        assert np.array_equal(seen(again), future)


# --- angular momentum -----------------------------------------------------------------------------


def angular_momentum(sim, origin):
    """Of the first grain about a point [kg m2/s]."""
    arm, mass = sim.position[0] - origin, sim.mass[0]
    return mass * np.cross(arm, sim.velocity[0]) + 0.4 * mass * R**2 * sim.spin[0]


ORIGIN = np.array([0.003, -0.002, 0.0])
FLOORS = {
    "plane": lambda **motion: body(**motion).plane((0, 0, 0), (0, 0, 1)),
    "disc": lambda **motion: body(**motion).disc(0.1),
    "rectangle": lambda **motion: body(**motion).rectangle((0, 0, 0), (0.1, 0, 0), (0, 0.1, 0)),
}


def change_and_impulse(sim, steps):
    """Change of the grain's angular momentum about the body's origin, and the angular impulse on
    the body."""
    before = angular_momentum(sim, ORIGIN)
    sim.advance(steps)
    return angular_momentum(sim, ORIGIN) - before, sim.wall_angular_impulse("w")


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.0, 20.0])
@pytest.mark.parametrize("floor", FLOORS)
def test_a_wall_takes_the_angular_momentum_that_a_hit_takes_from_a_grain(floor, rate):
    """A hit with rolling and spinning, without gravity: all three components."""
    walls = FLOORS[floor](origin=ORIGIN, spin=(0, 0, rate))
    sim = simulation(walls, gravity=0.0, precision="double")
    start, velocity = (0.013, 0.004, 1.001 * R), (0.05, 0.02, -0.5)
    sim.add_particles([start], R, velocity=[velocity], spin=[(50.0, -80.0, 120.0)])
    change, impulse = change_and_impulse(sim, 2000)
    assert sim.velocity[0, 2] > 0.0  # it has left again
    assert impulse == pytest.approx(-change, abs=1e-5 * np.linalg.norm(change))


@pytest.mark.slow
def test_a_top_that_slows_down_on_the_axis_turns_the_wall():
    """There nothing but torsion acts on either."""
    sim = simulation(FLOORS["plane"](origin=ORIGIN), precision="double")
    sim.add_particles([ORIGIN + [0, 0, 0.9999 * R]], R, spin=[(0, 0, 50.0)])
    change, impulse = change_and_impulse(sim, 10000)
    assert change[2] < -0.02 * 0.4 * sim.mass[0] * R**2 * 50.0  # by 6 % here
    assert impulse[2] == pytest.approx(-change[2], rel=1e-5)
