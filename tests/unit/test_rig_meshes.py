"""Each rig with a mesh of the shape of its own walls gives what its own walls give; a mesh that
leaks, or is not where or what the keys say, gets a sentence before a grain is made."""

import numpy as np
import pytest

from dem.io.stl import write_stl
from dem.run import run
from dem.spec import canonical, parse_spec

SIDES = 96


def rounded(profile, sides=SIDES):
    """Vertices and triangles of a closed profile of (radius, height), turned about z. The polygon
    has the area of the circle: volumes are alike."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    wide = np.sqrt(2.0 * np.pi / sides / np.sin(2.0 * np.pi / sides))
    rings = [
        np.column_stack([wide * r * np.cos(turn), wide * r * np.sin(turn), np.full(sides, z)])
        for r, z in profile
    ]
    here, after = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = []
    for k in range(len(profile)):
        a, b = k * sides, (k + 1) % len(profile) * sides
        faces.append(np.column_stack([a + here, a + after, b + here]))
        faces.append(np.column_stack([a + after, b + after, b + here]))
    points, faces = np.concatenate(rings), np.concatenate(faces)
    p = points[faces]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    return points, faces[area > 1e-12]


def slab(low, high):
    """Vertices and triangles of a box."""
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return np.asarray(low) + corners * (np.asarray(high) - low), np.array(faces)


def joined(*bodies):
    """One mesh of several."""
    points, faces, count = [], [], 0
    for vertices, triangles in bodies:
        points.append(vertices)
        faces.append(triangles + count)
        count += len(vertices)
    return np.concatenate(points), np.concatenate(faces)


def moved(body, by):
    return body[0] + by, body[1]


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


LIFTERS = [slab((12.0, -0.5, -0.5), (15.4, 0.5, 8.5)), slab((-15.4, -0.5, -0.5), (-12.0, 0.5, 8.5))]

RIGS = {
    "drop": ("plate_stl", slab((-3, -3, -2), (3, 3, 0)), {"drops": 2}, {}),
    "tilt": ("plate_stl", slab((-40, -30, -2), (40, 30, 0)), {"trials": 2}, {}),
    "wall_friction": (
        "plate_stl",
        slab((-12, -8, -2), (8, 8, 0)),
        {"ring_diameter_mm": 14, "slide_mm": 2},
        {"count": 200},
    ),
    "compression": (
        "lid_stl",
        slab((-5, -5, 0), (5, 5, 3)),
        {"box_width_mm": 10, "box_height_mm": 30, "lid_travel_mm": 29, "packing": "cubic"},
        {"count": 125},
    ),
    "bulk_density": ("vessel_stl", cup(), {"vessel_diameter_mm": 14, "taps": 2}, {"count": 300}),
    "lifted_cylinder": (
        "cylinder_stl",
        tube(),
        {"cylinder_diameter_mm": 16, "plate_diameter_mm": 80},
        {"count": 500},
    ),
    "drum": (
        "shell_stl",
        drum(),
        {"drum_diameter_mm": 30, "drum_width_mm": 8, "rotation_rate_deg_s": 180},
        {"count": 300},
    ),
    "draw_down": (
        "boxes_stl",
        boxes(),
        {
            "upper_width_mm": 36,
            "lower_width_mm": 44,
            "depth_mm": 6,
            "slot_width_mm": 16,
            "fall_height_mm": 30,
        },
        {"count": 600},
    ),
    "shear": (
        "lid_stl",
        vaned(6.0, 14.0, -2.0, 0.5, 1.0),
        {
            "inner_diameter_mm": 12,
            "outer_diameter_mm": 28,
            "preshear_displacement_mm": 2,
            "shear_displacement_mm": 3,
        },
        {"count": 700, "diameter_mm": 2.0},
    ),
}


def specified(name, geometry=(), particles=(), **parts):
    _, _, own, grains = RIGS[name]
    data = {"experiment": name, "geometry": own | dict(geometry), **parts}
    return parse_spec(data | {"particles": grains | dict(particles)})


def with_mesh(name, folder, body=None, **geometry):
    key, own, *_ = RIGS[name]
    write_stl(folder / "rig.stl", *(body or own))
    return specified(name, {key: str(folder / "rig.stl")} | geometry)


@pytest.mark.parametrize("name", RIGS)
def test_a_spec_without_a_mesh_keeps_the_name_that_it_had_before_there_were_any(name, tmp_path):
    key = RIGS[name][0]
    assert key not in canonical(specified(name))
    assert key in canonical(with_mesh(name, tmp_path))


def both(name, folder):
    """Metrics with the rig's own walls, and with the mesh."""
    own = run(specified(name), folder / "own")["metrics"]
    return own, run(with_mesh(name, folder), folder / "mesh")["metrics"]


def test_a_grain_rebounds_from_a_mesh_as_from_a_plate(tmp_path):
    own, mesh = both("drop", tmp_path)
    assert mesh["effective_restitution"] == pytest.approx(own["effective_restitution"], rel=1e-9)
    assert mesh["rebound_height_mm"] == pytest.approx(own["rebound_height_mm"], rel=1e-9)


def test_grains_slide_on_a_mesh_as_on_a_plate(tmp_path):
    own, mesh = both("tilt", tmp_path)
    # the angle is read at looks, which are 0.01 degrees apart
    assert mesh["sliding_angle_deg"] == pytest.approx(own["sliding_angle_deg"], abs=0.0101)


def test_a_punch_compresses_a_lattice_as_the_lid_does(tmp_path):
    own, mesh = both("compression", tmp_path)
    for metric in ("strain_at_load", "constrained_modulus_kPa", "compression_exponent"):
        assert mesh[metric] == pytest.approx(own[metric], rel=1e-6)
