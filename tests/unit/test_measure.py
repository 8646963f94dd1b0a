"""The angle of repose is measured on heaps whose angle is known."""

import numpy as np
import pytest

from dem.errors import MeasureError
from dem.measure.heap import measure_heap

PLATE = 0.04


def cone(angle, radius=1e-3, top=None, rounding=0.0, noise=0.0, seed=0):
    """Spheres on a jittered lattice below a cone of `angle` [deg] whose envelope passes the rim of
    the plate.

    top: height above which the cone is cut [m]; rounding: radius of the rounded apex [m]; noise: of
    the surface [m]."""
    rng = np.random.default_rng(seed)
    slope = np.tan(np.radians(angle))
    pitch = 0.7 * radius
    line = np.arange(-PLATE, PLATE, pitch)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    keep = np.hypot(x, y) < PLATE
    x, y = x[keep], y[keep]
    x, y = x + rng.uniform(-0.3, 0.3, x.shape) * pitch, y + rng.uniform(-0.3, 0.3, y.shape) * pitch
    r = np.hypot(x, y)
    surface = slope * (PLATE - r)
    if rounding:
        surface = slope * (PLATE - (np.sqrt(r**2 + rounding**2) - rounding * 0.5))
    if top is not None:
        surface = np.minimum(surface, top)
    surface = surface + rng.normal(0, noise, surface.shape)
    # a sphere of radius R under a slope touches it R / cos(angle) below
    z = surface - radius / np.cos(np.radians(angle))
    good = z > 0
    position = np.column_stack([x, y, z])[good]
    return position, np.full(good.sum(), radius), np.zeros((good.sum(), 3))


def test_a_rounded_cone_reads_a_little_flat():
    """The fit leaves the top fifth out; what is left is the mean slope of the rounded flank between
    20 and 80 %."""
    rounding = 0.006
    result = measure_heap(*cone(40, rounding=rounding), PLATE)
    r = np.linspace(0, PLATE, 4001)
    height = np.tan(np.radians(40)) * (PLATE - (np.sqrt(r**2 + rounding**2) - rounding / 2))
    flank = (height > 0.2 * height[0]) & (height < 0.8 * height[0])
    exact = np.degrees(np.arctan(-np.polyfit(r[flank], height[flank], 1)[0]))
    assert 38.5 < exact < 39.5
    assert result["angle_of_repose_deg"] == pytest.approx(exact, abs=0.2)
    assert result["radial_angle_deg"] == pytest.approx(exact, abs=0.2)


def test_flying_and_hanging_grains_do_not_count():
    position, radius, velocity = cone(35)
    extra = np.array([(0.0, 0.0, 0.12), (0.01, 0.0, 0.05)])
    x = np.vstack([position, extra])
    v = np.vstack([velocity, [(0, 0, 0), (0, 0, -1.0)]])
    r = np.append(radius, [1e-3, 1e-3])
    result = measure_heap(x, r, v, PLATE)
    assert result["angle_of_repose_deg"] == pytest.approx(35, abs=0.1)
    assert result["on_plate"] == len(position)


def test_the_angle_does_not_depend_on_how_the_heap_is_turned():
    position, radius, velocity = cone(40)
    c, s = np.cos(0.3), np.sin(0.3)
    turned = position @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
    a, b = (
        measure_heap(p, radius, velocity, PLATE)["angle_of_repose_deg"] for p in (position, turned)
    )
    assert a == pytest.approx(b, abs=0.3)


@pytest.mark.parametrize("count", [0, 5])
def test_a_few_grains_are_no_heap(count):
    with pytest.raises(MeasureError, match="no heap"):
        measure_heap(np.full((count, 3), 1e-3), np.full(count, 1e-3), np.zeros((count, 3)), PLATE)
