"""From a photograph of a heap to its two flank angles, with the fit that the simulation's heaps are
measured by."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps, UnidentifiedImageError

from calibration.errors import CalibrationError
from calibration.intake.photo.outline import NoOutlineError, outline
from dem.measure.heap import LOWER, UPPER, fit_flank

WIDEST = 1600  # px; finer pictures are reduced, an angle does not need more
LOWEST = 0.2  # share of the columns on a side that are taken for its base
LEAST_HEIGHT = 20  # px
MOST_TILT = 15.0  # deg of the base line
ROUGH = 0.04  # root mean square of outline less fitted line, over the height: more is no flank


@dataclass(frozen=True)
class HeapPhoto:
    """What was read: angles [deg], the base line's tilt, and the lines in pixels of the picture for
    showing them.

    outline (n, 2): columns and rows; flanks: two pairs of points; base: a pair of points; height
    [px].
    """

    path: Path
    left_deg: float
    right_deg: float
    tilt_deg: float
    height: float
    outline: np.ndarray
    flanks: tuple
    base: tuple
    reduced: float

    @property
    def angle_deg(self) -> float:
        """Mean of both flanks; a tilt of the camera raises one and lowers the other."""
        return 0.5 * (self.left_deg + self.right_deg)


def measure_photo(path: str | Path) -> HeapPhoto:
    """`HeapPhoto` of a picture: one heap from the side, before a plain backdrop.

    Raises CalibrationError naming the file where it is no picture, or shows no heap.
    """
    path = Path(path)
    picture, reduced = read_picture(path)
    try:
        rows = outline(picture)
    except NoOutlineError as error:
        raise CalibrationError(
            f"{path}: {error}; allowed: a heap before a plain backdrop"
        ) from None
    columns = np.flatnonzero(np.isfinite(rows))
    points = np.column_stack([columns, rows[columns]]).astype(float)
    return _fitted(path, points, reduced)


def read_picture(path: str | Path) -> tuple[np.ndarray, float]:
    """(rows, columns, 3) colours from 0 to 1, at most WIDEST wide, and by how much it was
    reduced."""
    try:
        with Image.open(path) as opened:
            image = ImageOps.exif_transpose(opened).convert("RGB")
    except UnidentifiedImageError:
        raise CalibrationError(f"{path}: is no picture; allowed: JPEG, PNG, TIFF, WebP") from None
    except OSError as error:
        reason = error.strerror or "is damaged"
        raise CalibrationError(f"{path}: cannot be read ({reason})") from None
    reduced = max(image.width / WIDEST, 1.0)
    if reduced > 1.0:
        image = image.resize((WIDEST, round(image.height / reduced)), Image.Resampling.LANCZOS)
    return np.asarray(image, float) / 255.0, reduced


def _fitted(path, points, reduced):
    (x0, y0), tilt = _base(points)
    if abs(tilt) > np.radians(MOST_TILT):
        raise CalibrationError(f"{path}: the base line is tilted by {np.degrees(tilt):.0f}°; "
                               f"allowed: at most {MOST_TILT:g}°")  # fmt: skip
    turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
    along, up = turn @ np.array([points[:, 0] - x0, y0 - points[:, 1]])
    order = np.argsort(along)
    stations = np.arange(along.min(), along.max(), 1.0)
    height = np.interp(stations, along[order], up[order])
    if height.max() < LEAST_HEIGHT:
        raise CalibrationError(f"{path}: what stands out is {height.max():.0f} pixels high; "
                               f"allowed: a heap of {LEAST_HEIGHT} or more")  # fmt: skip
    crest = int(np.mean(np.flatnonzero(height > 0.97 * height.max())))
    back = lambda p: tuple(np.array([x0, y0]) + np.array([1, -1]) * (turn.T @ p))  # noqa: E731
    angles, lines = [], []
    for side in (-1, 1):
        profile = height[crest::side]
        distance = np.arange(len(profile), dtype=float)
        angle = fit_flank(distance, profile, np.inf)
        if not np.isfinite(angle):
            which = "left" if side < 0 else "right"
            raise CalibrationError(
                f"{path}: the {which} flank is too short to fit; "
                "allowed: a heap with both flanks in the picture"
            )
        angles.append(angle)
        ends = _line(distance, profile, angle)
        lines.append(tuple(back(np.array([stations[crest] + side * d, h])) for d, h in ends))
        _check_straight(path, distance, profile, ends)
    base = tuple(back(np.array([s, 0.0])) for s in (stations[0], stations[-1]))
    return HeapPhoto(path, *angles, float(np.degrees(tilt)), float(height.max()), points,
                     tuple(lines), base, reduced)  # fmt: skip


def _check_straight(path, distance, height, ends):
    """Raise CalibrationError where the outline between the ends of the fitted line does not follow
    it."""
    (first, high), (last, low) = ends
    inside = (distance >= first) & (distance <= last)
    line = np.interp(distance[inside], [first, last], [high, low])
    off = float(np.sqrt(np.mean((height[inside] - line) ** 2))) if inside.any() else np.inf
    if off > ROUGH * height.max():
        raise CalibrationError(
            f"{path}: the outline leaves the fitted flank by {100 * off / height.max():.0f} % of "
            f"the height; allowed: {100 * ROUGH:g} %. A plainer backdrop of another colour helps"
        )


def _base(points):
    """A point of the base line and its angle [rad], counted as rising to the right: through the
    lowest on each side."""
    x, y = points.T
    crest = x[np.argmin(y)]
    lows = []
    for side in (x < crest, x >= crest):
        own = np.flatnonzero(side)
        lowest = own[np.argsort(-y[own])[: max(int(LOWEST * len(own)), 3)]]
        lows.append((np.median(x[lowest]), np.median(y[lowest])))
    (xa, ya), (xb, yb) = lows
    return (xa, ya), float(np.arctan2(ya - yb, xb - xa))


def _line(distance, height, angle):
    """Ends of the fitted line, from UPPER to LOWER of the height: through the middle of the points
    that were fitted."""
    top = height.max()
    inside = (height <= UPPER * top) & (height >= LOWER * top)
    middle = distance[inside].mean(), height[inside].mean()
    slope = np.tan(np.radians(angle))
    return [
        (middle[0] + (middle[1] - share * top) / slope, share * top) for share in (UPPER, LOWER)
    ]
