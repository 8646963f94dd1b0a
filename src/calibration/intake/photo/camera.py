"""A camera that looks down on a heap, and the angle of a flank that it sees too flat.

An edge of a cone's silhouette and the camera span a plane that touches the cone, and a plane that
touches a cone of slope theta is inclined by theta. So a line of the picture gives the angle by the
inclination of its plane (R. Hartley, A. Zisserman 2004, Multiple View Geometry, 2nd ed., section
8.6 on the contour of a surface; pinhole, the principal point in the middle of the picture). For a
camera far away this is tan(theta) = sqrt(m^2 + sin(pitch)^2) / cos(pitch) with the slope m in the
picture.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from calibration.errors import decoding
from calibration.intake.tables import refused, said_number
from dem.units import UnitError, in_unit

FULL_FRAME_MM = math.hypot(36.0, 24.0)
FOCAL_MM = (8.0, 300.0)
"""Of a photograph, as of a camera of 35 mm film."""
MOST_PITCH = 35.0
OFF_MIDDLE = 0.1
"""Of the picture's width, that a plumb line has to be away from its middle to tell anything."""
EXIF_IFD, FOCAL_35 = 0x8769, 0xA405


@dataclass(frozen=True)
class View:
    """How the camera stood, as it was told: its distance from the heap's axis and its height above
    the base [mm], or two points (x, y) of a plumb line in pixels of the file; focal: length [mm] as
    of 35 mm film, None for what the photograph says of itself."""

    place: tuple[float, float] | None = None
    plumb: tuple[tuple[float, float], tuple[float, float]] | None = None
    focal: float | None = None

    @property
    def known(self) -> bool:
        """Return whether a correction was asked for."""
        return self.place is not None or self.plumb is not None


def view_of(camera: str | None, plumb: str | None, focal: str | None) -> View:
    """`View` of the options' texts. Raises ConfigError naming option, value and what is allowed."""
    if camera and plumb:
        raise refused("two views")
    if focal and not (camera or plumb):
        raise refused("focal alone", f"--focal {focal}")
    stood = told("--camera", camera, _place), told("--plumb", plumb, _plumb)
    return View(*stood, told("--focal", focal, _focal))


def told(option: str, text: str | None, read: Callable[[str], Any]) -> Any:
    """Return what read(text) gives of an option, None of one that was not given. Raises ConfigError
    where that is None, or fails."""
    try:
        found = read(text) if text else None
    except (UnitError, ValueError, ZeroDivisionError):
        found = None
    if text and found is None:
        raise refused(option, f"{option} {text}", least=FOCAL_MM[0], most=FOCAL_MM[1])
    return found


def _place(text):
    distance, _, height = text.replace("/", ";").partition(";")
    found = said_number(distance, "mm"), said_number(height, "mm")
    return found if 1.0 <= found[0] <= 1e5 and 0.0 <= found[1] <= 1e5 else None


def _plumb(text):
    (xa, ya), (xb, yb) = ((float(x) for x in point.split(",")) for point in text.split("/"))
    long = abs(yb - ya) >= max(100.0, 2.0 * abs(xb - xa))
    return ((xa, ya), (xb, yb)) if long else None


def _focal(text):
    found = in_unit(text, "mm")
    return found if FOCAL_MM[0] <= found <= FOCAL_MM[1] else None


def seen_by(
    path: Path, view: View, size: tuple[int, int], reduced: float, base: np.ndarray, tilt: float,
    lines: Sequence[Sequence[Sequence[float]]],
) -> tuple[float, list[float]]:  # fmt: skip
    """(by how much the camera of a photograph looks down [deg], angles [deg] of the flanks whose
    silhouettes are the lines, pairs of points (x, y) [px]). size: of the reduced picture (columns,
    rows); base (2,): a point of the base line below the heap's middle, tilt [rad]: of the base line
    in the picture, counted as rising to the right. Raises ConfigError where the focal length is not
    known, or what was told does not go with the picture."""
    focal_mm = view.focal or _stated_focal(path)
    if focal_mm is None:
        raise refused("no focal", path)
    focal = focal_mm / FULL_FRAME_MM * math.hypot(*size)
    middle = (0.5 * (size[0] - 1), 0.5 * (size[1] - 1))
    across = np.array([math.cos(tilt), -math.sin(tilt)])
    down = np.array([math.sin(tilt), math.cos(tilt)])
    if view.place:
        below = float((base - middle) @ down)
        pitch = math.atan2(view.place[1], view.place[0]) - math.atan2(below, focal)
    else:
        pitch = _by_plumb(path, view.plumb, reduced, size, middle, across, down, focal)
    if abs(math.degrees(pitch)) > MOST_PITCH:
        raise refused("pitch", path, pitch=math.degrees(pitch), most=MOST_PITCH)
    up, angles = np.array([*(-down * math.cos(pitch)), -math.sin(pitch)]), []
    for line in lines:
        one, other = (np.array([*(np.array(p) - middle), focal]) for p in line)
        normal = np.cross(one, other)
        angles.append(math.degrees(math.acos(min(abs(normal @ up) / np.linalg.norm(normal), 1.0))))
    return math.degrees(pitch), angles


def _by_plumb(path, plumb, reduced, size, middle, across, down, focal):
    """Pitch [rad]: where the plumb line meets the picture's middle column lies the point that all
    plumb lines run to, at focal / tan(pitch) below the middle."""
    (xa, ya), (xb, yb) = (
        np.array([(p / reduced - middle) @ axis for axis in (across, down)])
        for p in map(np.array, plumb)
    )
    if min(abs(xa), abs(xb)) < OFF_MIDDLE * size[0] or xa * xb < 0.0:
        raise refused("near plumb", path, least=100 * OFF_MIDDLE)
    if xa == xb:
        return 0.0
    meets = ya - xa * (yb - ya) / (xb - xa)
    return math.atan2(focal, abs(meets)) * math.copysign(1.0, meets)


def _stated_focal(path):
    """Focal length [mm] as of 35 mm film that a photograph states, or None."""
    with decoding(path, "a picture"), Image.open(path) as opened:
        found = opened.getexif().get_ifd(EXIF_IFD).get(FOCAL_35)
    try:
        focal = float(found)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return focal if FOCAL_MM[0] <= focal <= FOCAL_MM[1] else None


def read_low(angle_deg: float, pitch_deg: float) -> float:
    """By how many degrees a far camera that looks down by `pitch_deg` reads a heap too flat, of
    which it shows `angle_deg`."""
    slope, pitch = math.tan(math.radians(angle_deg)), math.radians(pitch_deg)
    return math.degrees(math.atan(math.hypot(slope, math.sin(pitch)) / math.cos(pitch))) - angle_deg
