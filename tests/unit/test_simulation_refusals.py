"""What the engine refuses while a simulation is set up and run: the body, grain or law is named."""

import numpy as np
import pytest

from dem.contact.registry import ContactParameters, Laws, Material
from dem.errors import BlowUpError, MeshError
from dem.experiments.heap import Rig
from dem.io.stl import write_stl
from dem.run import run
from dem.simulation import Simulation
from dem.spec import parse_spec
from dem.walls.builder import WallSet
from facts import refused

TETRAHEDRON = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
SOME = ContactParameters(0.5, 0.5)


def test_a_run_with_an_open_mesh_leaves_nothing_unless_the_spec_takes_it(tmp_path):
    path = tmp_path / "open.stl"
    write_stl(path, TETRAHEDRON, FACES[:3])
    spec = parse_spec({"experiment": "heap", "geometry": {"plate_stl": str(path)}})
    with refused(MeshError, "3 edges", file="open.stl"):
        run(spec, tmp_path / "out")
    assert not (tmp_path / "out" / "result.json").exists()
    geometry = {"plate_stl": str(path), "meshes": "open"}
    assert Rig(parse_spec({"experiment": "heap", "geometry": geometry}).geometry).walls()


def salt(time_step, modulus=1e7, **options):
    """A simulation of salt grains alone."""
    materials = {"salt": Material(1210.0, modulus, 0.25)}
    return Simulation(materials, {("salt", "salt"): SOME}, time_step=time_step, **options)


def test_a_time_step_that_blows_up_is_named():
    sim = salt(1e-3, 1e9)
    sim.add_particles([[0, 0, 0], [2.1e-3, 0, 0]], 1e-3, velocity=[[1, 0, 0], [-1, 0, 0]])
    with refused(BlowUpError, "time step", particle=0, time=0.001):
        sim.advance(2000)


@pytest.mark.parametrize(
    ("grains", "floored", "word"),
    [
        ([("b", 2)], False, "b and b"),
        ([("b", 1), ("b", 1)], False, "b and b"),
        ([("a", 1), ("b", 1)], False, "b and a"),
        ([("a", 1)], True, "a and c"),
    ],
)
def test_grains_that_can_meet_without_parameters_are_refused(grains, floored, word):
    """Two grains of b, a grain of a beside one of b, and a grain of a over a floor of c."""
    material = Material(1210.0, 1e7, 0.25)
    walls = WallSet().body("floor", material="c").plane((0, 0, 0), (0, 0, 1))
    sim = Simulation(
        dict.fromkeys("abc", material),
        {("a", "a"): SOME, ("b", "c"): SOME},
        time_step=1e-6,
        walls=walls if floored else None,
    )
    *fine, (last, count) = grains
    for name, number in fine:
        sim.add_particles([[0.01 * n, 0, 0.1] for n in range(number)], 1e-3, material=name)
    with refused(ValueError, word):
        sim.add_particles([[0.01 * n, 0.1, 0.1] for n in range(count)], 1e-3, material=last)


def test_one_grain_needs_no_parameters_with_itself():
    material = Material(1210.0, 1e7, 0.25)
    walls = WallSet().body("floor", material="b").plane((0, 0, 0), (0, 0, 1))
    sim = Simulation(
        {"a": material, "b": material}, {("a", "b"): SOME}, time_step=1e-6, walls=walls
    )
    sim.add_particles([[0, 0, 1e-3]], 1e-3)
    sim.advance(10)
    assert sim.wall_force("floor")[2] < 0.0


@pytest.mark.parametrize(
    ("laws", "names"),
    [
        (Laws(rolling="viscous"), ["rolling", "viscous", "elastic_plastic"]),
        (Laws(cohesion="jkr", damping="plastic"), ["jkr", "tsuji", "plastic"]),
    ],
)
def test_laws_that_cannot_be_combined_are_refused_at_set_up(laws, names):
    with refused(ValueError, *names):
        salt(1e-5, laws=laws)


def test_a_particle_that_is_nowhere_stops_the_run():
    sim = salt(1e-5, laws=Laws(cohesion="jkr"))
    sim.add_particles([[0, 0, 0], [3e-3, 0, 0], [6e-3, 0, 0]], 1e-3)
    sim.particles.position[2, 0] = np.nan
    with refused(BlowUpError, particle=2, time=0.0):
        sim.advance(10)


@pytest.mark.parametrize("time_step", [0.0, -1e-5, float("nan")])
def test_a_time_step_goes_forward(time_step):
    with refused(ValueError, "time_step"):
        salt(time_step)


def test_two_grains_at_one_place_are_refused():
    with refused(ValueError, "position"):
        salt(1e-5).add_particles([[0, 0, 0], [0, 0, 1], [0, 0, 0]], 1e-3)
