"""Clumps, grains of up to ten spheres: mass and inertia of the union, free flight, experiments,
wrong files."""

import math

import numpy as np
import pytest
import small_rigs
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from calibration.errors import ConfigError
from calibration.intake.clump_from_mesh import cells_inside, fill_mesh, mesh_volume
from calibration.interface.commands import main
from dem.experiments.setup import add_grains, build_simulation
from dem.grains.clump import random_turns, shape_of, union
from dem.grains.dumbbell import moments
from dem.grains.sizes import largest_reach, smallest_radius
from dem.io.grain_tables import read_clump
from dem.io.stl import write_stl
from dem.run import run
from dem.spec import canonical, content_hash, parse_spec
from dem.walls.builder import WallSet
from facts import refused
from scenes import revolved

TRIPLE = "x_mm,y_mm,z_mm,radius_mm\n0,0,0,1\n1.0,0.2,0,0.8\n-0.3,0.9,0.5,0.6\n"
CUT = 4e-5
"""Share of volume and inertia that cutting by lines is stated to keep to."""


@pytest.fixture
def triple(tmp_path):
    """Path of a grain of three spheres without symmetry."""
    return written(tmp_path, TRIPLE)


def written(folder, text):
    path = folder / "clump.csv"
    path.write_text(text)
    return path


def spec_of(path, experiment="heap", **parts):
    """Run spec whose grains are those of a table."""
    particles = {"clump": {"file": str(path)}} | parts.pop("particles", {})
    return parse_spec({"experiment": experiment, "particles": particles} | parts)


def random_spheres(number, seed):
    """Centres (number, 3) and radii of spheres that overlap in a chain."""
    rng = np.random.default_rng(seed)
    radius, centre = rng.uniform(0.5, 1.0, number), np.zeros((number, 3))
    for k in range(1, number):
        out = rng.normal(size=3)
        step = 0.8 * (radius[k] + radius[k - 1]) / np.linalg.norm(out)
        centre[k] = centre[k - 1] + step * out
    return centre, radius


def voxels(centre, radius, pitch):
    """Volume, centre, inertia of a union from the voxels whose middle is inside, and the number of
    voxels at its surface."""
    low, high = (centre - radius[:, None]).min(0), (centre + radius[:, None]).max(0)
    axes = [np.arange(a + 0.37 * pitch, b, pitch) for a, b in zip(low, high, strict=True)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    gap = np.full(x.shape, np.inf)
    for (a, b, c), r in zip(centre, radius, strict=True):
        gap = np.minimum(gap, np.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) - r)
    place = np.column_stack([v[gap < 0.0] for v in (x, y, z)])
    middle = place.mean(0)
    arm = place - middle
    tensor = (arm**2).sum() * np.eye(3) - arm.T @ arm
    cell = pitch**3
    return cell * len(place), middle, cell * tensor, int((np.abs(gap) < 0.5 * pitch).sum())


@pytest.mark.parametrize(("number", "seed"), [(2, 1), (5, 3), (10, 5)])
def test_mass_centre_and_inertia_are_those_of_the_voxels(number, seed):
    """Each voxel at the surface is wrong by up to half its volume, at random: four standard
    deviations of their sum are allowed, and what the lines cut wrong."""
    centre, radius = random_spheres(number, seed)
    extent = float((centre + radius[:, None]).max() - (centre - radius[:, None]).min())
    pitch = extent / 150
    volume, middle, inertia, surface = voxels(centre, radius, pitch)
    found, where, tensor = union(centre, radius)
    error = 4.0 * pitch**3 * math.sqrt(surface / 12.0)
    reach = float((np.linalg.norm(centre - middle, axis=1) + radius).max())
    assert abs(found - volume) < error + CUT * volume
    assert np.abs(where - middle).max() < reach * (error / volume + CUT)
    assert np.abs(tensor - inertia).max() < reach**2 * error + CUT * tensor.max()
    assert found < 4.0 / 3.0 * math.pi * (radius**3).sum()


@pytest.mark.parametrize("elongation", [1.0, 1.3, 1.6, 2.0])
def test_two_spheres_have_the_closed_form_of_a_pair(elongation):
    axis = random_turns(1, np.random.default_rng(3))[0, :, 0]
    h = elongation - 1.0
    volume, middle, tensor = union(5.0 + np.array([-h * axis, h * axis]), np.ones(2))
    about, across = moments(1.0, elongation, 1.0)
    expected = about * np.outer(axis, axis) + across * (np.eye(3) - np.outer(axis, axis))
    assert volume == pytest.approx(4 / 3 * math.pi * (1 + 1.5 * h - 0.5 * h**3), rel=CUT)
    assert middle == pytest.approx([5.0, 5.0, 5.0], abs=1e-12)
    assert tensor == pytest.approx(expected, abs=CUT * across)


def test_random_turns_are_rotations_to_all_sides_alike():
    turn = random_turns(4000, np.random.default_rng(1))
    assert turn @ turn.transpose(0, 2, 1) == pytest.approx(np.tile(np.eye(3), (4000, 1, 1)))
    assert np.linalg.det(turn) == pytest.approx(1.0)
    # each component of an axis is even over -1..1 (Archimedes): its mean and mean square
    assert np.abs(turn.mean(0)).max() < 4.0 / math.sqrt(3 * 4000)
    assert np.abs((turn**2).mean(0) - 1 / 3).max() < 4.0 * math.sqrt(4 / 45 / 4000)


def flying(path, fraction):
    """A weightless grain of the table in double precision that turns about no axis of its own."""
    numerics = {"precision": "double", "rayleigh_fraction": fraction}
    spec = spec_of(path, numerics=numerics, particles={"diameter_mm": 2.0})
    sim = build_simulation(spec, WallSet(), gravity=(0.0, 0.0, 0.0))
    velocity = np.array([[0.2, -0.1, 0.3]])
    add_grains(sim, spec, np.zeros((1, 3)), np.array([1e-3]), velocity, np.random.default_rng(7))
    body = sim.clusters
    # near the middle axis, about which a free body tumbles
    spin = np.array([300.0, 3000.0, 600.0])
    body.momentum[0] = body.rotation[0] @ (body.inertia[0] * spin)
    return sim, spin


def tumbled(inertia, spin, time):
    """Spin in the body's axes after `time`, by Euler's equations."""
    a, b, c = inertia

    def euler(_, w):
        return [(b - c) / a * w[1] * w[2], (c - a) / b * w[2] * w[0], (a - b) / c * w[0] * w[1]]

    return solve_ivp(euler, (0.0, time), spin, rtol=1e-11, atol=1e-9).y[:, -1]


@pytest.mark.slow
def test_a_free_clump_keeps_energy_and_momenta_and_tumbles_as_euler_says(triple):
    errors = []
    for fraction, steps in ((0.4, 500), (0.2, 1000), (0.1, 2000), (0.05, 4000)):
        sim, spin = flying(triple, fraction)
        body, momentum, energy = sim.clusters, sim.clusters.momentum[0].copy(), []
        start = sim.kinetic_energy()
        for _ in range(20):
            sim.advance(steps // 20)
            energy.append(abs(sim.kinetic_energy() / start - 1.0))
        assert np.array_equal(body.momentum[0], momentum)
        assert body.velocity[0] == pytest.approx([0.2, -0.1, 0.3], rel=1e-15)
        now = body.rotation[0].T @ momentum / body.inertia[0]
        exact = tumbled(body.inertia[0], spin, sim.time)
        assert np.abs(exact - spin).max() > 1000.0, "it does not tumble"
        errors.append((max(energy), np.abs(now - exact).max()))
    slopes = np.diff(np.log2(errors), axis=0)
    assert slopes == pytest.approx(np.full((3, 2), -2.0), abs=0.2)  # second order
    assert errors[-1][0] < 1e-4


def test_a_grain_has_the_mass_of_the_sphere_whose_diameter_it_has(triple):
    spec = spec_of(triple, particles={"diameter_mm": 2.0})
    sim = build_simulation(spec, WallSet())
    radii = np.array([1e-3, 1.5e-3])
    add_grains(sim, spec, np.array([[0, 0, 0], [0, 0, 0.01]]), radii, 0.0, np.random.default_rng(1))
    mass = 4.0 / 3.0 * math.pi * radii**3 * spec.materials.particle.density_kg_m3
    assert sim.clusters.mass == pytest.approx(mass, rel=1e-12)
    assert sim.cubed_radius.reshape(2, 3).sum(1) == pytest.approx(radii**3, rel=1e-6)
    # size scales all: moments as the fifth power
    assert sim.clusters.inertia[1] == pytest.approx(1.5**5 * sim.clusters.inertia[0], rel=1e-9)
    assert sim.radius[3:] == pytest.approx(1.5 * sim.radius[:3], rel=1e-6)
    assert (sim.grain_count, list(sim.grain)) == (2, [0, 0, 0, 3, 3, 3])
    # the centre of mass is where the grain was asked for
    assert sim.clusters.position == pytest.approx(np.array([[0, 0, 0], [0, 0, 0.01]]), abs=1e-18)
    out = np.linalg.norm(sim.position[:3], axis=1) + sim.radius[:3]
    assert out.max() == pytest.approx(largest_reach(spec), rel=1e-6)
    assert sim.radius[:3].min() == pytest.approx(smallest_radius(spec), rel=1e-6)


def test_a_run_is_named_after_the_spheres_and_spheres_keep_their_name(triple, tmp_path):
    (tmp_path / "more").mkdir()
    same = written(tmp_path / "more", "# scanned on Monday\n" + TRIPLE)
    assert content_hash(spec_of(triple)) == content_hash(spec_of(same))
    other = written(tmp_path / "more", TRIPLE.replace("0.8", "0.81"))
    size = {"diameter_mm": 2.0}
    assert content_hash(spec_of(triple, particles=size)) != content_hash(
        spec_of(other, particles=size)
    )
    assert "clump" not in canonical(parse_spec({"experiment": "heap"}))
    again = parse_spec(spec_of(triple).model_dump(mode="json"))
    assert content_hash(again) == content_hash(spec_of(triple))


def test_a_clump_of_one_sphere_is_a_sphere_to_the_bit(tmp_path):
    one = written(tmp_path, "x_mm,y_mm,z_mm,radius_mm\n0.3,-2,7.1,0.7\n")
    rig = {"geometry": {"vessel_diameter_mm": 14, "taps": 1}}
    rig["materials"] = {"particle": {"shear_modulus_Pa": 1e6}}
    sizes = {"count": 300, "sizes": {"diameters_mm": [1.7, 2.1], "fractions": [0.5, 0.5]}}
    sphere = parse_spec({"experiment": "bulk_density", "particles": sizes} | rig)
    clump = spec_of(one, "bulk_density", particles=sizes, **rig)
    a, b = (run(s, tmp_path / n)["metrics"] for s, n in ((sphere, "a"), (clump, "b")))
    assert a == b
    with np.load(tmp_path / "a" / "final.npz") as x, np.load(tmp_path / "b" / "final.npz") as y:
        for name in x.files:
            np.testing.assert_array_equal(x[name], y[name], err_msg=name)


BLUNT = "x_mm,y_mm,z_mm,radius_mm\n0,0,0,1\n0.2,0,0,0.95\n0,-0.1,0.15,0.95\n"
PRESSED = {"count": 200}, {"box_width_mm": 12, "box_height_mm": 30, "lid_travel_mm": 29,
                           "normal_stress_kPa": 5}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("experiment", ["compression", "discharge", "heap"])
def test_clumps_go_through_experiments(tmp_path, experiment):
    pressed = experiment == "compression"
    particles, geometry = PRESSED if pressed else small_rigs.RIGS[experiment]
    hard = 1e7 if pressed else 3e6  # softer, a pressed grain overlaps too far
    spec = spec_of(
        written(tmp_path, TRIPLE if pressed else BLUNT),
        experiment,
        particles={"diameter_mm": 1.6} | particles,
        materials={"particle": {"shear_modulus_Pa": hard}},
        contacts=small_rigs.ROUGH,
        geometry=geometry,
    )
    count, volume = spec.particles.count, math.pi / 6.0 * spec.particles.diameter_mm**3
    found = run(spec, tmp_path)["metrics"]
    with np.load(tmp_path / "final.npz") as state:
        grain, size = np.unique(state["grain"], return_counts=True)
    assert set(size) <= {3}  # no grain is torn
    # grains count by their volume and not by their spheres
    if pressed:
        room = geometry["box_width_mm"] ** 2 * found["depth_mm"]
        assert found["compressed_solid_fraction"] == pytest.approx(count * volume / room, rel=1e-6)
    if experiment == "discharge":
        assert found["discharged_share"] == pytest.approx(1.0 - len(grain) / count, abs=1e-6)


SIDES, RINGS = 60, 80


def two_balls(radius, half):
    """The union of two balls about (0, 0, -half) and (0, 0, half)."""
    z = (half + radius) * np.cos(np.linspace(np.pi, 0.0, RINGS))
    r = np.sqrt(np.maximum(radius**2 - (np.abs(z) - half) ** 2, 0.0))
    return revolved(np.column_stack([r, z]), SIDES)


def tilted(vertices):
    """The same body, turned so that no face lies along a line of cells."""
    return Rotation.from_rotvec([0.7, 0.4, -0.3]).apply(vertices)


def table(path):
    read = read_clump(path)
    return np.column_stack([read[c] for c in ("x_mm", "y_mm", "z_mm", "radius_mm")])


def test_the_cells_have_the_volume_of_a_tilted_body():
    vertices, triangles = two_balls(1.0, 0.6)
    inside, _, pitch = cells_inside(tilted(vertices), triangles)
    assert inside.sum() * pitch**3 == pytest.approx(mesh_volume(vertices, triangles), rel=0.01)


def test_balls_are_found_again(tmp_path):
    half = 0.6
    vertices, triangles = two_balls(1.0, half)
    write_stl(tmp_path / "grain.stl", vertices, triangles)
    fill_mesh(tmp_path / "grain.stl", 2)
    found = table(tmp_path / "grain.csv")
    cell = 2.0 * (1.0 + half) / 96
    expected = [[0, 0, -half, 1.0], [0, 0, half, 1.0]]
    assert found[np.argsort(found[:, 2])] == pytest.approx(np.array(expected), abs=2 * cell)


@pytest.mark.slow
def test_an_ellipsoid_is_filled_and_turns_as_it_does(tmp_path):
    z = 2.0 * np.cos(np.linspace(np.pi, 0.0, RINGS))
    r = np.sqrt(np.maximum(1.0 - (z / 2.0) ** 2, 0.0))
    vertices, triangles = revolved(np.column_stack([r, z]), SIDES)
    write_stl(tmp_path / "grain.stl", tilted(vertices), triangles)
    said = " ".join(fill_mesh(tmp_path / "grain.stl", 10))
    spheres = table(tmp_path / "grain.csv")
    assert len(spheres) <= 10
    # every sphere is inside: the largest has the short axis' radius
    assert 0.95 < spheres[:, 3].max() < 1.0 + 1e-6
    shape = shape_of(tuple(map(tuple, spheres)))
    assert (shape.scale**3) / 2.0 > 0.9  # of the ellipsoid's volume, 4/3 pi 1 1 2
    # a solid ellipsoid of the volume of a unit sphere: axes a, a, 2a with 2 a^3 = 1
    a = 0.5 ** (1.0 / 3.0)
    mass = 4.0 / 3.0 * np.pi
    moments = mass / 5.0 * a**2 * np.array([2.0, 5.0, 5.0])
    assert np.linalg.eigvalsh(shape.inertia) == pytest.approx(moments, rel=0.1)
    assert f"diameter_mm: {2 * 2 ** (1 / 3):.2f}"[:-1] in said
    clump = {"file": str(tmp_path / "grain.csv")}
    parse_spec({"experiment": "heap", "particles": {"clump": clump, "diameter_mm": 2.5}})


def test_what_cannot_be_filled_gets_a_sentence(tmp_path, capsys):
    vertices, triangles = two_balls(1.0, 0.6)
    write_stl(tmp_path / "leaks.stl", vertices, triangles[1:])
    with refused(ConfigError, path="leaks.stl"):
        fill_mesh(tmp_path / "leaks.stl", 8)
    write_stl(tmp_path / "grain.stl", vertices, triangles)
    assert main(["clump", str(tmp_path / "grain.stl"), "--spheres", "11"]) == 2
    assert "1 to 10" in capsys.readouterr().err
    (tmp_path / "grain.csv").write_text("mine")
    assert main(["clump", str(tmp_path / "grain.stl")]) == 2
    assert "exists already" in capsys.readouterr().err
    assert (tmp_path / "grain.csv").read_text() == "mine"
