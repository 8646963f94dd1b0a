"""A mesh filled with spheres: shapes whose spheres are known, and what is refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibration.errors import ConfigError
from calibration.intake.clump_from_mesh import cells_inside, fill_mesh, mesh_volume
from calibration.interface.commands import main
from dem.grains.clump import shape_of
from dem.io.grain_tables import read_clump
from dem.io.stl import write_stl
from dem.spec import parse_spec
from facts import refused
from scenes import revolved

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
