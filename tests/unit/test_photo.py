"""Heaps drawn with a known angle and photographed with all that goes wrong: the angle comes back
within 0.3 degrees."""

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from calibration.intake.measurements import read_measured
from calibration.intake.photo import measure_photo
from calibration.intake.photo.camera import FULL_FRAME_MM, read_low, view_of
from calibration.interface.commands import main
from dem.measure.heap import fit_flank
from dem.measure.heap import outline as discs_outline

BIAS = 0.3  # deg
DARK = ((0.85, 0.82, 0.75), (0.35, 0.25, 0.15), (0.5, 0.5, 0.52))
LIGHT = ((0.1, 0.12, 0.2), (0.9, 0.85, 0.7), (0.3, 0.2, 0.15))
WHEAT = ((0.25, 0.35, 0.6), (0.8, 0.65, 0.35), (0.75, 0.75, 0.75))
ROWS, COLUMNS, FINER = 480, 700, 2


def pixels(tilt):
    """Coordinates (x, y), y upwards from the table, of each sample of a picture tilted by `tilt`
    [deg]."""
    y, x = np.mgrid[0 : ROWS * FINER, 0 : COLUMNS * FINER] / FINER
    x, y = x - COLUMNS / 2, 0.8 * ROWS - y
    t = np.radians(tilt)
    return x * np.cos(t) + y * np.sin(t), y * np.cos(t) - x * np.sin(t)


def photograph(path, inside, x, y, colours, noise=0.0, shadow=0.0, backdrop="plain"):
    """A heap (mask `inside`) on a table before a backdrop, with a soft shadow beside it and a
    sensor's noise."""
    rng = np.random.default_rng(7)
    wall, sand, table = map(np.array, colours)
    image = np.broadcast_to(wall, (*x.shape, 3)).copy()
    if backdrop == "gradient":
        image *= (1 - 0.25 * (x / COLUMNS + 0.5) + 0.15 * y / ROWS)[..., None]
    if backdrop == "stripes":
        image *= (1 + 0.05 * np.sign(np.sin(x / 7)))[..., None]
    cast = ndimage.shift(inside.astype(float), (20 * FINER, 60 * FINER), order=0)
    image[y <= 0] = table
    image *= (1 - shadow * ndimage.gaussian_filter(cast, 12 * FINER))[..., None]
    grains = ndimage.gaussian_filter(rng.normal(size=x.shape), 3)
    image[inside] = sand * (1 + 0.15 * grains[inside] / grains.std())[:, None]
    image = image.reshape(ROWS, FINER, COLUMNS, FINER, 3).mean((1, 3))
    image = ndimage.gaussian_filter(image, (0.7, 0.7, 0)) + rng.normal(0, noise, image.shape)
    Image.fromarray((255 * np.clip(image, 0, 1)).astype(np.uint8)).save(path)
    return path


def cone(path, angle, colours, tilt=0.0, **more):
    """A cone of the angle with a rounded tip: straight between 20 and 80 % of its height."""
    x, y = pixels(tilt)
    base, tip, k = 0.36 * COLUMNS, 0.05 * COLUMNS, np.tan(np.radians(angle))
    r = np.abs(x)
    height = np.where(r > tip, k * (base - r), k * (base - (r * r / tip + tip) / 2))
    return photograph(path, (y < height) & (y > 0), x, y, colours, **more)


TROUBLES = [
    {"noise": 0.05},
    {"tilt": -3.0, "noise": 0.03},
    {"shadow": 0.35},
    {"backdrop": "gradient", "noise": 0.02},
    {"backdrop": "stripes", "noise": 0.02},
    {"shadow": 0.35, "tilt": 1.5, "noise": 0.03, "backdrop": "gradient"},
]


HEAPS = [(18.0, WHEAT), (27.4, DARK), (36.0, LIGHT)]
ONCE = [
    pytest.param(*HEAPS[n % 3], trouble, marks=() if n >= 3 else pytest.mark.slow)
    for n, trouble in enumerate(TROUBLES)
]


def check(tmp_path, angle, colours, trouble):
    photo = measure_photo(cone(tmp_path / "heap.png", angle, colours, **trouble))
    assert photo.angle_deg == pytest.approx(angle, abs=BIAS)
    assert photo.tilt_deg == pytest.approx(trouble.get("tilt", 0.0), abs=1.0)


@pytest.mark.parametrize(("angle", "colours", "trouble"), ONCE, ids=str)
def test_a_drawn_heap_has_its_angle(tmp_path, angle, colours, trouble):
    check(tmp_path, angle, colours, trouble)


def test_grains_have_the_angle_that_the_simulation_measures(tmp_path):
    """Discs heaped at random: the photograph and the simulation's own outline see the same
    flanks."""
    rng = np.random.default_rng(3)
    across, z = rng.uniform(-260, 260, 6000), rng.uniform(0, 130, 6000)
    kept = z < 0.5 * (260 - np.abs(across)) - 4
    across, z, radius = across[kept], z[kept], np.full(int(kept.sum()), 5.0)
    stations = np.arange(0.0, 300.0, 1.0)
    wanted = np.mean(
        [fit_flank(stations, discs_outline(s * across, z, radius, stations), 300) for s in (1, -1)]
    )
    x, y = pixels(0.0)
    heights = np.maximum(
        discs_outline(across, z, radius, np.arange(-COLUMNS / 2, COLUMNS / 2, 0.5)), 0.0
    )
    inside = (y < heights[None, :]) & (y > 0)
    photo = measure_photo(photograph(tmp_path / "discs.png", inside, x, y, WHEAT, noise=0.02))
    assert photo.angle_deg == pytest.approx(wanted, abs=BIAS)


def test_the_command_writes_a_table_that_a_study_reads(tmp_path, capsys):
    paths = [str(cone(tmp_path / f"{n} ä.png", a, DARK)) for n, a in enumerate((27.0, 28.0))]
    out = tmp_path / "measured.csv"
    assert main(["angle", *paths, "--out", str(out), "--scale", "10 cm/360"]) == 0
    said = capsys.readouterr().out
    assert "2 values, 2" in said
    assert "mean 27.5" in said
    table = read_measured(out)
    (angles,), (heights,) = (table.of("heap", q) for q in ("angle_of_repose", "height"))
    assert angles.readings == pytest.approx([27.0, 28.0], abs=BIAS)
    wanted = [0.36 * COLUMNS - 0.025 * COLUMNS] * np.tan(np.radians([27.0, 28.0])) / 3.6
    assert heights.readings == pytest.approx(wanted, rel=0.02)
    for n in (0, 1):
        with Image.open(tmp_path / f"{n} ä.fit.png") as shown:
            assert shown.size == (COLUMNS, ROWS)
    assert main(["angle", *paths, "--out", str(out)]) == 2
    assert "exists already" in capsys.readouterr().err


CAMERA_ROWS, CAMERA_COLUMNS, FOCAL_MM, RADIUS = 600, 800, 56.0, 100.0
FOCAL = FOCAL_MM / FULL_FRAME_MM * np.hypot(CAMERA_ROWS, CAMERA_COLUMNS)
DISTANCE = 900.0


def photograph_from(path, angle, height, aim=20.0, focal_said=True):
    """A cone [mm] on a table, from DISTANCE and `height` above its base, the optical axis through
    `aim` above the base. Each pixel is the ray through it. Returns the pitch [rad]."""
    pitch = np.arctan2(height - aim, DISTANCE)
    v, u = np.mgrid[0:CAMERA_ROWS, 0:CAMERA_COLUMNS].astype(float)
    u, v = u - (CAMERA_COLUMNS - 1) / 2, v - (CAMERA_ROWS - 1) / 2
    # camera at (0, -DISTANCE, height); x to the right, y forward, z up
    dx = u
    dy = FOCAL * np.cos(pitch) - v * np.sin(pitch)
    dz = -v * np.cos(pitch) - FOCAL * np.sin(pitch)
    k = np.tan(np.radians(angle))
    top = k * RADIUS - height
    # x^2 + y^2 = ((top - t dz) / k)^2 on the cone
    a = dx**2 + dy**2 - (dz / k) ** 2
    b = -2 * DISTANCE * dy + 2 * top * dz / k**2
    c = DISTANCE**2 - (top / k) ** 2
    square = b * b - 4 * a * c
    inside = np.zeros(u.shape, bool)
    for sign in (-1.0, 1.0):
        with np.errstate(invalid="ignore", divide="ignore"):
            t = (-b + sign * np.sqrt(square)) / (2 * a)
            z = height + t * dz
            inside |= (square >= 0) & (t > 0) & (z >= 0) & (z <= k * RADIUS)
    image = np.where(inside[..., None], [90, 60, 40], [205, 210, 220]).astype(np.uint8)
    exif = Image.Exif()
    if focal_said:
        exif[0x8769] = {0xA405: int(FOCAL_MM)}
    Image.fromarray(image).save(path, quality=95, exif=exif)
    return pitch


def plumb(pitch, x=-80.0):
    """Two points of a plumb line `x` [mm] beside the heap's middle, in pixels, as the option has
    them."""
    points = []
    for z in (-60.0, 60.0):  # from the optical axis, at the cone's middle
        depth = DISTANCE / np.cos(pitch) - z * np.sin(pitch)
        points.append((FOCAL * x / depth, -FOCAL * z * np.cos(pitch) / depth))
    at = [(u + (CAMERA_COLUMNS - 1) / 2, v + (CAMERA_ROWS - 1) / 2) for u, v in points]
    return "/".join(f"{u:.2f},{v:.2f}" for u, v in at)


@pytest.mark.parametrize(("angle", "height"), [(24.0, 180.0), (34.0, 220.0), (30.0, 180.0)])
def test_a_camera_that_looks_down_is_corrected_by_its_place_or_a_plumb_line(
    angle, height, tmp_path
):
    path = tmp_path / "a.jpg"
    pitch = photograph_from(path, angle, height)
    plain = measure_photo(path).angle_deg
    assert plain < angle - 0.3  # else there is nothing to correct
    by_place = measure_photo(path, view_of(f"{DISTANCE}mm/{height}mm", None, None))
    assert by_place.angle_deg == pytest.approx(angle, abs=0.3)
    assert by_place.pitch_deg == pytest.approx(np.degrees(pitch), abs=0.6)
    by_plumb = measure_photo(path, view_of(None, plumb(pitch), None))
    assert by_plumb.angle_deg == pytest.approx(angle, abs=0.3)


def test_a_level_camera_needs_no_correction(tmp_path):
    path = tmp_path / "a.jpg"
    photograph_from(path, 30.0, 20.0)
    view = view_of(f"{DISTANCE}mm/20mm", None, "56mm")
    assert measure_photo(path, view).angle_deg == pytest.approx(30.0, abs=0.3)
    assert measure_photo(path).angle_deg == pytest.approx(30.0, abs=0.5)


def test_by_how_much_a_far_camera_reads_low_is_a_closed_form():
    for true, pitch in ((30.0, 10.0), (25.0, 5.0)):
        t, p = np.tan(np.radians(true)), np.radians(pitch)
        seen = np.degrees(np.arctan(np.sqrt((t * np.cos(p)) ** 2 - np.sin(p) ** 2)))
        assert read_low(seen, pitch) == pytest.approx(true - seen)
