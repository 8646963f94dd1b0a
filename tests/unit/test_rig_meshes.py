"""Each rig with a mesh of the shape of its own walls gives what its own walls give; a mesh that
leaks, or is not where or what the keys say, gets a sentence before a grain is made."""

import numpy as np
import pytest
from small_rigs import RIGS

from dem.errors import MeshError
from dem.experiments import experiments
from dem.experiments.mesh import read_mesh
from dem.io.stl import write_stl
from dem.render import export_vtk, read_run
from dem.run import run
from dem.spec import canonical, parse_spec
from facts import refused, tells
from scenes import revolved
from vtk_files import read_vtp

SIDES = 96


def rounded(profile):
    """Vertices and triangles of a closed profile of (radius, height), turned about z. The polygon
    has the area of the circle: volumes are alike."""
    turn = 2.0 * np.pi / SIDES
    wide = np.sqrt(turn / np.sin(turn))
    return revolved([(wide * r, z) for r, z in (*profile, profile[0])], SIDES)


def slab(low, high):
    """Vertices and triangles of a box."""
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return np.asarray(low) + corners * (np.asarray(high) - low), np.array(faces)


def sheet(profile, low, high):
    """Vertices and triangles of a sheet over a line of (x, z) between two y."""
    n = len(profile)
    k = np.arange(n - 1)
    faces = np.concatenate(
        [np.column_stack([k, k + 1, k + n]), np.column_stack([k + 1, k + 1 + n, k + n])]
    )
    return np.concatenate([np.insert(profile, 1, y, axis=1) for y in (low, high)]), faces


def joined(*bodies):
    """One mesh of several."""
    points, faces, count = [], [], 0
    for vertices, triangles in bodies:
        points.append(vertices)
        faces.append(triangles + count)
        count += len(vertices)
    return np.concatenate(points), np.concatenate(faces)


def cup(radius=7.0, high=60.0, wall=1.0, floor=0.0):
    r = radius
    return rounded(
        [(0.0, floor), (r, floor), (r, high), (r + wall, high), (r + wall, -wall), (0.0, -wall)]
    )


def tube(radius=8.0, high=80.0, wall=1.0):
    r = radius
    return rounded([(r, 0.0), (r, high), (r + wall, high), (r + wall, 0.0)])


def drum(radius=15.0, width=8.0, wall=1.0):
    r, w = radius, wall
    inside = rounded([(0.0, 0.0), (r, 0.0), (r, width), (0.0, width)])
    return joined(inside, rounded([(0.0, -w), (r + w, -w), (r + w, width + w), (0.0, width + w)]))


def boxes(upper=36.0, lower=44.0, deep=6.0, slot=16.0, floor=30.0, high=110.0, wall=2.0):
    """Both boxes, depth and widths inside, of overlapping slabs."""
    u, w, y, s = 0.5 * upper, 0.5 * lower, 0.5 * deep, 0.5 * slot
    out, side = w + wall, y + wall
    bodies = [slab((-out, -side - 0.1, -wall), (out, side + 0.1, 0.0))]
    for k in (-1.0, 1.0):
        ends = sorted([k * s, k * (u + 0.7)])
        bodies.append(slab((ends[0], -y - 1.1, floor - 1.0), (ends[1], y + 1.1, floor)))
        ends = sorted([k * u, k * (u + wall)])
        bodies.append(slab((ends[0], -y - 0.9, floor - 0.5), (ends[1], y + 0.9, high)))
        ends = sorted([k * w, k * (w + 0.8 * wall)])
        bodies.append(slab((ends[0], -y - 0.7, -0.6), (ends[1], y + 0.7, floor + 0.3)))
        ends = sorted([k * y, k * side])
        bodies.append(slab((-out + 0.2, ends[0], -0.4), (out - 0.2, ends[1], high)))
    return joined(*bodies)


def vaned(inner, outer, low, high, plate):
    """A plate of a ring between z = 0 and `plate`, with vanes between two heights."""
    r0, r1 = inner, outer
    bodies = [rounded([(r0, 0.0), (r1, 0.0), (r1, plate), (r0, plate)])]
    for turn in 2.0 * np.pi * np.arange(24) / 24:
        points, faces = slab((r0 + 0.05, -0.05, low), (r1 - 0.05, 0.05, high))
        c, s = np.cos(turn), np.sin(turn)
        bodies.append((points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), faces))
    return joined(*bodies)


MESHES = {
    "drop": ("plate_stl", slab((-3, -3, -2), (3, 3, 0))),
    "tilt": ("plate_stl", slab((-40, -30, -2), (40, 30, 0))),
    "wall_friction": ("plate_stl", slab((-12, -8, -2), (8, 8, 0))),
    "compression": ("lid_stl", slab((-5, -5, 0), (5, 5, 3))),
    "bulk_density": ("vessel_stl", cup()),
    "lifted_cylinder": ("cylinder_stl", tube()),
    "drum": ("shell_stl", drum()),
    "draw_down": ("boxes_stl", boxes()),
    "shear": ("lid_stl", vaned(6.0, 14.0, -2.0, 0.5, 1.0)),
}
"""Experiment: (key, mesh of the shape of its own walls)."""


def specified(name, geometry=(), particles=(), **parts):
    """Run spec of a rig, with further keys of its geometry and grains."""
    grains, own = RIGS[name]
    data = {"experiment": name, "geometry": own | dict(geometry), **parts}
    return parse_spec(data | {"particles": grains | dict(particles)})


def with_mesh(name, folder, body=None, **parts):
    """The same with a mesh, that of the rig's own shape unless given."""
    key, own = MESHES[name]
    write_stl(folder / "rig.stl", *(body or own))
    return specified(name, {key: str(folder / "rig.stl")}, **parts)


@pytest.mark.parametrize("name", MESHES)
def test_a_spec_without_a_mesh_keeps_the_name_that_it_had_before_there_were_any(name, tmp_path):
    key = MESHES[name][0]
    assert key not in canonical(specified(name))
    assert key in canonical(with_mesh(name, tmp_path))


def both(name, folder, **parts):
    """Metrics with the rig's own walls, and with the mesh; the walls of both can be drawn."""
    specs = {"own": specified(name, **parts), "mesh": with_mesh(name, folder, **parts)}
    for kind, spec in specs.items():
        run(spec, folder / kind)
        _, walls = export_vtk(read_run(folder / kind))
        assert len(read_vtp(walls)["Polys"]) > 0
    return tuple(read_run(folder / kind).metrics for kind in specs)


def columns(name, folder, *metrics, runs=4, **parts):
    """Each metric of several seeds, (runs, 2): with the rig's own walls and with the mesh."""
    found = []
    for seed in range(1, runs + 1):
        (folder / str(seed)).mkdir()
        found.append(both(name, folder / str(seed), seed=seed, **parts))
    return [np.array([[m[metric] for m in pair] for pair in found]) for metric in metrics]


@pytest.mark.slow
def test_a_grain_rebounds_from_a_mesh_as_from_a_plate(tmp_path):
    own, mesh = both("drop", tmp_path)
    assert mesh["effective_restitution"] == pytest.approx(own["effective_restitution"], rel=1e-9)
    assert mesh["rebound_height_mm"] == pytest.approx(own["rebound_height_mm"], rel=1e-9)


@pytest.mark.slow
def test_grains_slide_on_a_mesh_as_on_a_plate(tmp_path):
    own, mesh = both("tilt", tmp_path)
    # the angle is read at looks, which are 0.01 degrees apart
    assert mesh["sliding_angle_deg"] == pytest.approx(own["sliding_angle_deg"], abs=0.0101)


def test_a_punch_compresses_a_lattice_as_the_lid_does(tmp_path):
    own, mesh = both("compression", tmp_path)
    for metric in ("strain_at_load", "constrained_modulus_kPa", "compression_exponent"):
        assert mesh[metric] == pytest.approx(own[metric], rel=1e-6)


@pytest.mark.slow
def test_grains_that_do_not_roll_slide_on_a_mesh_at_their_coefficient(tmp_path):
    contacts = {
        "particle_particle": {"rolling_friction": 5.0},
        "particle_wall": {"static_friction": 0.4, "rolling_friction": 5.0},
    }
    for found in both("wall_friction", tmp_path, contacts=contacts):
        assert found["wall_friction"] == pytest.approx(0.4, rel=0.01)


@pytest.mark.slow
def test_a_saw_tooth_holds_grains_that_have_hardly_any_friction(tmp_path):
    """A flat plate slides away under the bed; teeth must lift it. Without any friction the bed goes
    round in the ring for ever."""
    smooth = {"restitution": 0.3, "static_friction": 0.01, "rolling_friction": 0.0}
    contacts = {"particle_particle": smooth, "particle_wall": smooth}
    teeth = np.array([(-12.3 + 0.667 * k, -0.6 if k % 2 else 0.0) for k in range(35)])
    parts = {"contacts": contacts, "numerics": {"max_time_s": 8.0}}
    spec = with_mesh("wall_friction", tmp_path, sheet(teeth, -8.0, 8.0), **parts)
    toothed = run(spec, tmp_path / "teeth")["metrics"]
    flat = run(specified("wall_friction", **parts), tmp_path / "flat")["metrics"]
    assert flat["wall_friction"] == pytest.approx(0.01, rel=1e-3)
    assert toothed["wall_friction"] > 0.05


@pytest.mark.slow
def test_a_vessel_of_a_mesh_weighs_grains_as_the_cylinder_does(tmp_path):
    """The polygon has the circle's area. The ratio of two fillings of a few hundred grains scatters
    by 1.6 % (40 pairs, mean 0.1 ± 0.3 %), that of the means of four by 0.8 %."""
    metrics = "poured_density_kg_m3", "tapped_density_kg_m3"
    for found in columns("bulk_density", tmp_path, *metrics):
        own, mesh = found.mean(axis=0)
        assert mesh == pytest.approx(own, rel=0.03)


def test_the_volume_of_a_cup_is_that_of_its_frustum(tmp_path):
    low, high, tall = 7.0, 11.0, 60.0
    wall = [(high + 1.0, tall), (low + 1.0, -1.0), (0.0, -1.0)]
    cup_of = rounded([(0.0, 0.0), (low, 0.0), (high, tall), *wall])
    mesh = read_mesh(with_mesh("bulk_density", tmp_path, cup_of), "vessel_stl")
    level = 36.0
    top = low + (high - low) * level / tall
    volume = np.pi * level * (low**2 + low * top + top**2) / 3.0
    assert mesh.volume(1e-3 * level) == pytest.approx(1e-9 * volume, rel=1e-3)


FLOOR = vaned(6.0, 14.0, -0.5, 2.0, -1.0)
"""Floor of the shear cell: a plate below z = 0 with vanes above."""


def with_floor(folder, body=FLOOR, **parts):
    """Run spec of the shear cell with a mesh for its floor."""
    write_stl(folder / "floor.stl", *body)
    return specified("shear", {"floor_stl": str(folder / "floor.stl")}, **parts)


def test_a_floor_of_the_shear_cell_that_is_not_what_the_keys_say_gets_a_sentence(tmp_path):
    prepare, (points, faces) = experiments()["shear"].prepare, FLOOR
    prepare(with_floor(tmp_path))
    for body, facts in (
        ((points, faces[1:]), ("leaks", "edges")),
        ((points + [0.0, 0.0, 1.0], faces), ("surface", "z = 1 mm")),
        (vaned(7.5, 14.0, -0.5, 2.0, -1.0), ("ring", "surface misses")),
        (vaned(6.0, 15.0, -0.5, 2.0, -1.0), ("14 mm", "outer wall")),
    ):
        with refused(MeshError, *facts, file="floor.stl"):
            prepare(with_floor(tmp_path, body))


def ridged(tilted=0.0, high=0.0):
    """A plate of 1 mm below z = 0 with sharp ridges of 0.7 mm that end at a height, between the
    points at which plates are measured, and turned in the plane by an angle [rad]."""
    tops = np.arange(-90.0, 90.0, 1.37) + 0.123
    line = sorted({(x + dx, z) for x in tops for dx, z in ((-0.3, high - 0.7), (0, high))})
    c, s = np.cos(tilted), np.sin(tilted)
    points, faces = sheet(np.array(line), -90.0, 90.0)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), faces


@pytest.mark.parametrize("tilted", [0.0, 0.3])
@pytest.mark.parametrize("name", ["tilt", "wall_friction"])
def test_sharp_ridges_count_wherever_they_lie(name, tilted, tmp_path):
    experiments()[name].prepare(with_mesh(name, tmp_path, ridged(tilted)))
    said = refusal(name, tmp_path, ridged(tilted, high=0.2))
    assert tells(said, "z = 0.2 mm", "0 mm")
    said = refusal(name, tmp_path, ridged(tilted, high=-0.2))
    assert tells(said, "z = -0.2 mm", "0 mm")


def refusal(name, folder, body):
    """What the rig says of a mesh."""
    with pytest.raises(MeshError) as error:
        experiments()[name].prepare(with_mesh(name, folder, body))
    return str(error.value)


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_that_leaks_or_lies_elsewhere_is_refused(name, tmp_path):
    points, faces = MESHES[name][1]
    experiments()[name].prepare(with_mesh(name, tmp_path))
    assert tells(refusal(name, tmp_path, (points, faces[1:])), "leaks", "edges", "mm")
    said = refusal(name, tmp_path, (points + [0.0, 0.0, 1.0], faces))
    assert "z = " in said
    assert tells(said, "0 mm", "0.05 mm")
    assert refusal(name, tmp_path, (0.3 * points, faces))


@pytest.mark.parametrize(
    ("name", "body", "facts"),
    [
        ("drop", slab((-0.5, -3, -2), (0.5, 3, 0)), ("too small",)),
        ("tilt", slab((-30, -30, -2), (40, 30, 0)), ("surface misses", "(-40, -30) mm")),
        ("wall_friction", slab((-8, -8, -2), (8, 8, 0)), ("path", "surface misses")),
        (
            "wall_friction",
            joined(slab((-12, -8, -5), (8, 8, -2)), slab((-12, 0, -1.9), (8, 8, 0))),
            ("2 mm deep", "smallest grain's radius", "1 mm"),
        ),
        ("compression", slab((-6, -5, 0), (6, 5, 3)), ("walls", "5 mm")),
        ("compression", slab((-3, -5, 0), (5, 5, 3)), ("underside misses", "(-4, -4) mm")),
        ("bulk_density", cup(radius=8.0), ("16 mm", "geometry.vessel_diameter_mm", "14 mm")),
        ("bulk_density", cup(high=10.0), ("183 grains", "rim")),
        ("lifted_cylinder", cup(radius=8.0, high=80.0), ("lower rim", "z = -1 mm")),
        (
            "lifted_cylinder",
            rounded([(0, 0), (9, 0), (9, 80), (8, 80), (8, 1), (0, 1)]),
            ("floor", "lid"),
        ),
        ("lifted_cylinder", tube(wall=40.0), ("wider", "plate")),
        ("drum", drum(width=9.0), ("end plate", "z = 9 mm")),
        ("drum", tube(radius=15.0, high=8.0), ("no end plate",)),
        (
            "drum",
            joined(drum(), slab((5.0, -0.5, -0.5), (15.4, 0.5, 8.5))),
            ("5 mm", "axis", "7.5 mm"),
        ),
        ("draw_down", boxes(slot=12.0), ("slot", "z = 30 mm")),
        ("draw_down", boxes(floor=29.0), ("upper floor", "z = 29 mm", "30 mm")),
        ("draw_down", boxes(high=50.0), ("too low",)),
        ("shear", vaned(7.5, 14.0, -2.0, 0.5, 1.0), ("ring", "surface misses")),
        ("shear", vaned(6.0, 15.0, -2.0, 0.5, 1.0), ("14 mm", "outer wall")),
    ],
)
def test_a_mesh_that_is_not_what_the_keys_say_gets_a_sentence(name, body, facts, tmp_path):
    assert tells(refusal(name, tmp_path, body), *facts)
