"""Every malformed spec gets one clear error: the key, the value, and what is allowed."""

import copy

import numpy as np
import pytest

from dem.contact.registry import ContactParameters, Laws, Material
from dem.errors import BlowUpError, MeshError, SpecError
from dem.experiments import experiments
from dem.experiments.heap import Rig
from dem.io.stl import read_stl, write_stl
from dem.run import run
from dem.simulation import Simulation
from dem.spec import load_spec, parse_spec
from dem.walls.builder import WallSet
from facts import refused

HEAP = {"experiment": "heap"}
SIZES = {"by": "number", "diameters_mm": [1.0, 2.0], "fractions": [0.5, 0.5]}

CASES = [
    ({"experiment": "pile"}, "experiment", ", ".join(experiments())),
    ({"sed": 1}, "sed", "seed"),
    ({"seed": "one"}, "seed", "integer"),
    ({"materials": {"particle": {"poisson_ratio": 0.5}}}, "poisson_ratio", "less than 0.5"),
    ({"materials": {"steel": {}}}, "materials.steel", "particle, wall"),
    (
        {"contacts": {"particle_particle": {"restitution": 0}}},
        "restitution",
        "greater than or equal to 0.03",
    ),
    ({"contacts": {"particle_wall": {"rolling_friction": "much"}}}, "rolling_friction", "number"),
    ({"laws": {"cohesion": "sjkr"}}, "laws.cohesion", "cohesion_energy_density_J_m3"),
    ({"laws": {"damping": "plastic"}}, "laws.damping", "yield_velocity_m_s"),
    (
        {"laws": {"friction": "stress_dependent"}, "law_parameters": {"friction_exponent": 0.2}},
        "laws.friction",
        "friction_reference_force_N",
    ),
    ({"law_parameters": {"surface_energy_J_m2": 0.1}}, "surface_energy_J_m2", "laws.cohesion: jkr"),
    (
        {
            "laws": {"friction": "stress_dependent"},
            "law_parameters": {"friction_exponent": 0.9, "friction_reference_force_N": 1},
        },
        "friction_exponent",
        "less than or equal to",
    ),
    (
        {
            "laws": {"cohesion": "jkr", "damping": "thornton"},
            "law_parameters": {"surface_energy_J_m2": 0.1},
        },
        "laws.damping",
        "tsuji",
    ),
    ({"particles": {"count": 0}}, "particles.count", "greater than or equal to 1"),
    (
        {"particles": {"diameter_mm": 5e-5}, "geometry": {"injection_speed_m_s": 1e-4}},
        "numerics.precision",
        "double where a grain has 9.8e-20 kg",
    ),
    (
        {"particles": {"diameter_mm": 8}},
        "geometry.orifice_diameter_mm",
        "3 of the largest grain",
    ),
    ({"particles": {"elongation": 2.1}}, "particles.elongation", "less than or equal to 2"),
    (
        {"experiment": "tilt", "particles": {"elongation": 1.5}},
        "particles.elongation",
        "1 in this experiment; elongated grains are for bulk_density, ",
    ),
    # two spheres of 4.4 mm / 2^(1/3) in a row
    (
        {"particles": {"diameter_mm": 4.4, "elongation": 2.0}},
        "geometry.orifice_diameter_mm",
        "3 of the largest grain (6.98456 mm)",
    ),
    (
        {"particles": {"sizes": {**SIZES, "fractions": [0.5, 0.4]}}},
        "particles.sizes.fractions",
        "sum to 1",
    ),
    (
        {"particles": {"sizes": {**SIZES, "diameters_mm": [0.1, 2.0]}}},
        "particles.sizes.diameters_mm",
        "ratio",
    ),
    (
        {"geometry": {"funnel_top_diameter_mm": 15}},
        "funnel_top_diameter_mm",
        "more than the orifice",
    ),
    ({"geometry": {"plate_diameter_mm": 5}}, "plate_diameter_mm", "4 of the largest"),
    ({"geometry": {"drop_height_mm": 150}}, "geometry.drop_height_mm", "orifice_diameter_mm"),
    ({"numerics": {"time_step_s": 1e-3}}, "numerics.time_step_s", "Rayleigh"),
    ({"numerics": {"max_time_s": float("nan")}}, "numerics.max_time_s", "finite"),
    ({"output": {"frames": 5}}, "output.frames", "frame_interval_s"),
]


@pytest.mark.parametrize(
    ("change", "key", "allowed"), CASES, ids=[f"{i}-{c[1]}" for i, c in enumerate(CASES)]
)
def test_a_malformed_spec_names_the_key_and_what_is_allowed(change, key, allowed):
    with pytest.raises(SpecError) as error:
        parse_spec(copy.deepcopy(HEAP | change), file="bad.yaml")
    message = str(error.value)
    assert message.startswith("bad.yaml: ")
    assert key in message
    assert allowed in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("text", "word"), [("a: [1", "line"), ("- 1\n- 2\n", "mapping"), ("\x00", "YAML")]
)
def test_a_file_that_is_no_mapping_is_named(tmp_path, text, word):
    path = tmp_path / "spec.yaml"
    path.write_text(text)
    with pytest.raises(SpecError) as error:
        load_spec(path)
    assert str(path) in str(error.value)
    assert word in str(error.value)


def test_a_missing_file_is_named(tmp_path):
    with refused(SpecError, "nowhere.yaml", key="(file)"):
        load_spec(tmp_path / "nowhere.yaml")


TETRAHEDRON = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def test_an_open_mesh_is_refused_where_it_must_be_closed(tmp_path):
    write_stl(tmp_path / "closed.stl", TETRAHEDRON, FACES)
    write_stl(tmp_path / "open.stl", TETRAHEDRON, FACES[:3])
    assert len(read_stl(tmp_path / "closed.stl", closed=True)[1]) == 4
    with refused(MeshError, "3", file="open.stl"):
        read_stl(tmp_path / "open.stl", closed=True)


@pytest.mark.parametrize("key", ["plate_stl", "funnel_stl"])
@pytest.mark.parametrize(("name", "word"), [("none", "none.stl"), ("open", "3 edges")])
def test_a_run_with_an_unusable_mesh_leaves_nothing(tmp_path, key, name, word):
    write_stl(tmp_path / "open.stl", TETRAHEDRON, FACES[:3])
    path = tmp_path / f"{name}.stl"
    spec = parse_spec({"experiment": "heap", "geometry": {key: str(path)}})
    with refused(MeshError, word, file=path.name):
        run(spec, tmp_path / "out")
    assert not (tmp_path / "out" / "result.json").exists()


def test_a_mesh_with_free_edges_is_taken_where_the_spec_says_so(tmp_path):
    write_stl(tmp_path / "sheet.stl", TETRAHEDRON, FACES[:3])
    geometry = {"plate_stl": str(tmp_path / "sheet.stl"), "meshes": "open"}
    spec = parse_spec({"experiment": "heap", "geometry": geometry})
    assert Rig(spec.geometry).walls() is not None


def test_grains_made_inside_each_other_are_named():
    salt = Material(1210.0, 1e7, 0.25)
    sim = Simulation(
        {"salt": salt}, {("salt", "salt"): ContactParameters(0.5, 0.5)}, time_step=1e-5
    )
    sim.add_particles([[0, 0, 0], [0.5e-3, 0, 0]], 1e-3)
    with refused(BlowUpError, particle=0, time=0.0):
        sim.advance(1)


def test_a_time_step_that_blows_up_is_named():
    salt = Material(1210.0, 1e9, 0.25)
    sim = Simulation(
        {"salt": salt}, {("salt", "salt"): ContactParameters(0.5, 0.5)}, time_step=1e-3
    )
    sim.add_particles([[0, 0, 0], [2.1e-3, 0, 0]], 1e-3, velocity=[[1, 0, 0], [-1, 0, 0]])
    with refused(BlowUpError, "time step", particle=0, time=0.001):
        sim.advance(2000)


SOME = ContactParameters(0.5, 0.5)


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
        (Laws(torsion="none at all"), ["torsion", "none at all", "marshall"]),
        (Laws(damping="none"), ["hertz", "damping", "tsuji", "none"]),
        (Laws(cohesion="jkr", damping="plastic"), ["jkr", "tsuji", "plastic"]),
        (Laws(drag="stokes"), ["drag", "stokes", "schiller_naumann"]),
    ],
)
def test_laws_that_cannot_be_combined_are_refused_at_set_up(laws, names):
    salt = Material(1210.0, 1e7, 0.25)
    with refused(ValueError, *names):
        Simulation(
            {"salt": salt},
            {("salt", "salt"): ContactParameters(0.5, 0.5)},
            laws=laws,
            time_step=1e-5,
        )
