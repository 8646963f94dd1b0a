"""Pictures of runs: spheres where they are, lit and hidden rightly, with the lines that the angle
was read from."""

from dataclasses import replace

import numpy as np
import pytest

from dem.cli import main
from dem.errors import DemError
from dem.io.vtk import write_grains
from dem.measure.heap import measure_heap, silhouette_angles
from dem.render import draw_run, read_run
from dem.render.image import LINE, fitted_flanks, heap_grains
from dem.render.raster import NOBODY, View, cover
from dem.results import write_result
from dem.spec import parse_spec
from facts import refused
from vtk_files import read_vtp

PLATE = 0.02
RADIUS = 0.0005


def cone(slope_deg=38.0, spread=0.0):
    """Grains on a lattice within a cone that nearly fills the plate."""
    line = np.arange(-PLATE, PLATE, 2 * RADIUS)
    x, y, z = (a.ravel() for a in np.meshgrid(line, line, line[line >= 0.0] + RADIUS))
    top = np.tan(np.radians(slope_deg)) * (0.85 * PLATE - np.hypot(x, y))
    position = np.column_stack([x, y, z])[z < top]
    radius = np.full(len(position), RADIUS)
    if spread:
        radius *= 1.0 - spread * np.random.default_rng(1).random(len(radius))
    return position, radius


@pytest.fixture
def run(tmp_path):
    """A folder as `dem run` leaves it, with a cone for a heap and two frames."""
    position, radius = cone(spread=0.3)
    folder = tmp_path / "run"
    (folder / "frames").mkdir(parents=True)
    velocity, tag = np.zeros_like(position), np.arange(len(position))
    for k, share in enumerate((0.0, 0.5)):
        part = slice(0, int(share * len(position)))
        state = (position[part], radius[part], velocity[part], tag[part])
        write_grains(folder / "frames" / f"grains_{k:05d}.vtp", *state)
    np.savez(folder / "final.npz", position=position, radius=radius, velocity=velocity, tag=tag)
    spec = parse_spec({"experiment": "heap", "geometry": {"plate_diameter_mm": 2e3 * PLATE}})
    metrics = measure_heap(position, radius, velocity, PLATE) | {"in_funnel": 0}
    write_result(folder, spec, metrics, {})
    return folder


def view(**changes):
    return View(
        **{
            "azimuth": 0.0,
            "elevation": 0.0,
            "scale": 1e4,
            "centre": (0.0, 0.0, 0.0),
            "width": 200,
            "height": 160,
            **changes,
        }
    )


@pytest.mark.parametrize(("azimuth", "elevation"), [(0.0, 0.0), (73.0, 31.0)])
def test_a_sphere_covers_its_disc_and_its_surface_lies_at_its_radius(azimuth, elevation):
    centre, r = np.array([[0.002, -0.001, 0.001]]), np.array([0.004])
    at = view(azimuth=azimuth, elevation=elevation)
    depth, owner = cover(at, centre, r)
    assert (owner == 0).sum() == pytest.approx(np.pi * (1e4 * r[0]) ** 2, rel=0.01)
    points = at.points(np.where(owner == 0, depth, 0.0))[owner == 0]
    assert np.linalg.norm(points - centre[0], axis=1) == pytest.approx(r[0], rel=1e-9)


def test_the_nearer_sphere_hides_the_other_whatever_their_order():
    near, far = [0.0, -0.004, 0.0], [0.0, 0.004, 0.0]  # seen along +y from azimuth 0
    for order in ((near, far), (far, near)):
        _, owner = cover(view(), np.array(order), np.full(2, 0.002))
        assert owner[80, 100] == order.index(near)
    assert owner[0, 0] == NOBODY


def test_the_flanks_are_those_of_the_measurement():
    position, radius = cone(spread=0.3)
    part = heap_grains(position, radius, np.zeros_like(position), PLATE)
    position, radius = position[part], radius[part]
    expected = silhouette_angles(position, radius, PLATE).reshape(-1, 2)
    for turn, (right, left) in zip(range(0, 180, 5), expected, strict=True):
        flanks = fitted_flanks(position, radius, PLATE, turn)
        assert [f.angle_deg for f in flanks] == pytest.approx([left, right], abs=1e-9)
        for flank in flanks:
            run_, rise = np.subtract(flank.end, flank.begin)
            assert np.degrees(np.arctan2(-rise, abs(run_))) == pytest.approx(flank.angle_deg)


def test_the_image_shows_the_lines_and_is_reproducible(run):
    finished = read_run(run)
    image = np.asarray(draw_run(finished, width=300))
    assert image.shape[1] == 300
    red = np.abs(image.astype(int) - LINE).max(axis=2) < 40
    assert red[:, :150].sum() > 60
    assert red[:, 150:].sum() > 60
    assert (image == np.asarray(draw_run(finished, width=300))).all()
    # a grain that falls beside the plate is none of the heap, and no reason to colour by speed
    more = {"position": (0.02, 0, -0.003), "velocity": (0, 0, -1.0), "radius": RADIUS, "tag": 0}
    grains = {k: np.concatenate([getattr(finished, k), [v]]) for k, v in more.items()}
    assert (image == np.asarray(draw_run(replace(finished, **grains), width=300))).all()


def test_the_last_state_opens_as_vtk(run):
    assert main(["render", str(run), "--vtk"]) == 0
    grains, state = read_vtp(run / "final.vtp"), np.load(run / "final.npz")
    assert grains["Points"] == pytest.approx(state["position"], abs=1e-9)
    assert grains["radius"] == pytest.approx(state["radius"])
    height = read_vtp(run / "final_walls.vtp")["Points"][:, 2]
    assert height.min() == pytest.approx(0.0, abs=1e-9)  # the plate
    assert height.max() > 0.075  # the funnel's orifice


def test_a_run_that_cannot_be_drawn_says_why(run, tmp_path, capsys):
    assert main(["render", str(tmp_path)]) == 2
    assert "no result.json" in capsys.readouterr().err
    finished = read_run(run)
    emptied = {k: getattr(finished, k)[:0] for k in ("position", "radius", "velocity", "tag")}
    with refused(DemError, "no grain"):  # as of an emptied silo
        draw_run(replace(finished, **emptied))
    (run / "final.npz").write_bytes(b"cut off")
    with refused(DemError, file="final.npz"):
        read_run(run)
