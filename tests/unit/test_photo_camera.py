"""A camera that looks down on a cone: the cone is drawn by rays, and its angle comes back."""

import numpy as np
import pytest
from PIL import Image

from calibration.intake.photo import measure_photo
from calibration.intake.photo.camera import FULL_FRAME_MM, read_low, view_of

ROWS, COLUMNS, FOCAL_MM, RADIUS = 600, 800, 56.0, 100.0
FOCAL = FOCAL_MM / FULL_FRAME_MM * np.hypot(ROWS, COLUMNS)
DISTANCE = 900.0


def photograph(path, angle, height, aim=20.0, focal_said=True):
    """A cone [mm] on a table, from DISTANCE and `height` above its base, the optical axis through
    `aim` above the base. Each pixel is the ray through it. Returns the pitch [rad]."""
    pitch = np.arctan2(height - aim, DISTANCE)
    v, u = np.mgrid[0:ROWS, 0:COLUMNS].astype(float)
    u, v = u - (COLUMNS - 1) / 2, v - (ROWS - 1) / 2
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
    at = [(u + (COLUMNS - 1) / 2, v + (ROWS - 1) / 2) for u, v in points]
    return "/".join(f"{u:.2f},{v:.2f}" for u, v in at)


@pytest.mark.parametrize(("angle", "height"), [(24.0, 180.0), (34.0, 220.0), (30.0, 180.0)])
def test_a_camera_that_looks_down_is_corrected_by_its_place_or_a_plumb_line(
    angle, height, tmp_path
):
    path = tmp_path / "a.jpg"
    pitch = photograph(path, angle, height)
    plain = measure_photo(path).angle_deg
    assert plain < angle - 0.3  # else there is nothing to correct
    by_place = measure_photo(path, view_of(f"{DISTANCE}mm/{height}mm", None, None))
    assert by_place.angle_deg == pytest.approx(angle, abs=0.3)
    assert by_place.pitch_deg == pytest.approx(np.degrees(pitch), abs=0.6)
    by_plumb = measure_photo(path, view_of(None, plumb(pitch), None))
    assert by_plumb.angle_deg == pytest.approx(angle, abs=0.3)


def test_a_level_camera_needs_no_correction(tmp_path):
    path = tmp_path / "a.jpg"
    photograph(path, 30.0, 20.0)
    view = view_of(f"{DISTANCE}mm/20mm", None, "56mm")
    assert measure_photo(path, view).angle_deg == pytest.approx(30.0, abs=0.3)
    assert measure_photo(path).angle_deg == pytest.approx(30.0, abs=0.5)


def test_by_how_much_a_far_camera_reads_low_is_a_closed_form():
    for true, pitch in ((30.0, 10.0), (25.0, 5.0)):
        t, p = np.tan(np.radians(true)), np.radians(pitch)
        seen = np.degrees(np.arctan(np.sqrt((t * np.cos(p)) ** 2 - np.sin(p) ** 2)))
        assert read_low(seen, pitch) == pytest.approx(true - seen)
