"""Heaps drawn with a known angle and photographed with all that goes wrong: the angle comes back
within 0.3 degrees."""

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from calibration.intake.measurements import read_measured
from calibration.intake.photo import measure_photo
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
