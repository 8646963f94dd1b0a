"""From a photograph of a heap to its two flank angles: the outline of what stands before a plain
backdrop, in each column of the picture the height of its edge, and the fit that the simulation's
heaps are measured by; and of several photographs a table of measurements, with the pictures that
show the fit: outline, base line and flanks.

The backdrop is a smooth surface of colour, fitted to the margins of the picture. From the first
pixel that leaves it the column is followed down to the first steep edge: a shadow is soft, the edge
of a heap is not.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from PIL import Image, ImageDraw, ImageFont, ImageOps
from scipy import ndimage

from calibration.errors import decoding
from calibration.files import write_table
from calibration.intake.measurements import readings_table
from calibration.intake.photo.camera import View, read_low, seen_by, told, view_of
from calibration.intake.tables import refused, said_number, summary
from dem.io.files import digest_of, replace_file
from dem.measure.heap import LOWER, UPPER, fit_flank
from dem.tables.limits import MOST_PIXELS, check_file

SMALLEST = 60  # px
WIDEST = 1600  # px; finer pictures are reduced, an angle does not need more
MOST_REDUCED = 3.5e6  # px in all, for a picture that is much taller than wide
LOWEST = 0.2  # share of the columns on a side that are taken for its base
LEAST_HEIGHT = 20  # px
MOST_TILT = 15.0  # deg of the base line
ROUGH = 0.04  # root mean square of outline less fitted line, over the height: more is no flank
LEVEL = View()


@dataclass(frozen=True)
class HeapPhoto:
    """What was read: angles [deg], the base line's tilt, and the lines in pixels of the picture for
    showing them.

    outline (n, 2): columns and rows; flanks: two pairs of points; base: a pair of points; height
    [px]; pitch_deg: by how much the camera looked down, where it was told: the angles are then
    corrected for it.
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
    pitch_deg: float | None = None

    @property
    def angle_deg(self) -> float:
        """Mean of both flanks; a tilt of the camera raises one and lowers the other."""
        return 0.5 * (self.left_deg + self.right_deg)


def measure_photo(path: str | Path, view: View = LEVEL) -> HeapPhoto:
    """`HeapPhoto` of a picture: one heap from the side, before a plain backdrop. view: how the
    camera stood, a level one far away unless it is told.

    Raises ConfigError naming the file where it is no picture, or shows no heap.
    """
    path = Path(path)
    picture, reduced = read_picture(path)
    rows = outline(picture)
    if rows is None:
        raise refused("no outline", path)
    columns = np.flatnonzero(np.isfinite(rows))
    points = np.column_stack([columns, rows[columns]]).astype(float)
    return _fitted(path, points, reduced, picture.shape[1::-1], view)


def read_picture(path: str | Path) -> tuple[np.ndarray, float]:
    """(rows, columns, 3) colours from 0 to 1, at most WIDEST wide and MOST_REDUCED pixels in all,
    and by how much the picture was reduced. Raises ConfigError where it is none."""
    image = open_picture(path)
    if min(image.size) < SMALLEST:
        value = f"{image.width} x {image.height} pixels"
        raise refused("small picture", path, value=value, least=SMALLEST)
    area = image.width * image.height
    reduced = max(image.width / WIDEST, math.sqrt(area / MOST_REDUCED), 1.0)
    if reduced > 1.0:
        size = [max(round(s / reduced), 1) for s in image.size]
        image = image.resize(size, Image.Resampling.LANCZOS)
    return np.asarray(image, float) / 255.0, reduced


def open_picture(path: str | Path) -> Image.Image:
    """The picture of a file, upright, in RGB. Raises ConfigError for what is none, is damaged, or
    has more pixels than are read."""
    with decoding(path, "a picture: JPEG, PNG, TIFF or WebP"):
        check_file(path, "photograph")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a large picture, and odd tags: both are read
            try:
                with Image.open(path) as opened:
                    if opened.width * opened.height > MOST_PIXELS:
                        raise Image.DecompressionBombError
                    return ImageOps.exif_transpose(opened).convert("RGB")
            except Image.DecompressionBombError:
                raise refused("many pixels", path, most=MOST_PIXELS / 1e6) from None


def _fitted(path, points, reduced, size, view):
    (x0, y0), tilt = _base(points)
    if abs(tilt) > np.radians(MOST_TILT):
        raise refused("tilt", path, tilt=np.degrees(tilt), most=MOST_TILT)
    turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
    along, up = turn @ np.array([points[:, 0] - x0, y0 - points[:, 1]])
    order = np.argsort(along)
    stations = np.arange(along.min(), along.max(), 1.0)
    height = np.interp(stations, along[order], up[order])
    if height.max(initial=0.0) < LEAST_HEIGHT:
        raise refused("low heap", path, height=height.max(initial=0.0), least=LEAST_HEIGHT)
    crest = int(np.mean(np.flatnonzero(height > 0.97 * height.max())))
    back = lambda p: tuple(np.array([x0, y0]) + np.array([1, -1]) * (turn.T @ p))  # noqa: E731
    angles, lines = [], []
    for side in (-1, 1):
        profile = height[crest::side]
        distance = np.arange(len(profile), dtype=float)
        angle = fit_flank(distance, profile, np.inf)
        if not np.isfinite(angle):
            raise refused("short flank", path, which="left" if side < 0 else "right")
        angles.append(angle)
        ends = _line(distance, profile, angle)
        lines.append(tuple(back(np.array([stations[crest] + side * d, h])) for d, h in ends))
        _check_straight(path, distance, profile, ends)
    base = tuple(back(np.array([s, 0.0])) for s in (stations[0], stations[-1]))
    pitch = None
    if view.known:
        below = np.array(back(np.array([stations[crest], 0.0])))
        pitch, angles = seen_by(path, view, size, reduced, below, tilt, lines)
    return HeapPhoto(path, *angles, float(np.degrees(tilt)), float(height.max()), points,
                     tuple(lines), base, reduced, pitch)  # fmt: skip


def _check_straight(path, distance, height, ends):
    """Raise ConfigError where the outline between the ends of the fitted line does not follow
    it."""
    (first, high), (last, low) = ends
    inside = (distance >= first) & (distance <= last)
    line = np.interp(distance[inside], [first, last], [high, low])
    off = float(np.sqrt(np.mean((height[inside] - line) ** 2))) if inside.any() else np.inf
    if not np.isfinite(off):
        raise refused("no flank", path)
    if off > ROUGH * height.max():
        raise refused("rough flank", path, off=100 * off / height.max(), most=100 * ROUGH)


def _base(points):
    """A point of the base line and its angle [rad], counted as rising to the right: through the
    lowest on each side. Low and high are counted from the chord between the outline's ends, so that
    a flat heap may be rolled by more than its own angle."""
    x, y = points.T
    few = max(len(x) // 50, 1)
    ends = [(np.median(x[own]), np.median(y[own])) for own in (slice(few), slice(-few, None))]
    (xa, ya), (xb, yb) = ends
    rise = ya + (yb - ya) * (x - xa) / max(xb - xa, 1.0) - y
    crest = x[np.argmax(rise)]
    lows = []
    for side in (x < crest, x >= crest):
        own = np.flatnonzero(side) if side.any() else np.arange(len(x))
        lowest = own[np.argsort(rise[own], kind="stable")[: max(int(LOWEST * len(own)), 3)]]
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


BLUR = 1.5  # px, against the noise of the sensor
TOP, SIDES = 0.15, 0.06  # shares of the picture that are taken for the backdrop
STEEP = 0.25  # of the usual steepness of the outline: less is a shadow
LEAST_CONTRAST = 4.0  # of the outline, in units of CIELAB; an eye tells 2 apart
NOISE = 6.0  # spreads of the backdrop that do not count
MEDIAN = 5  # columns
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
"""Linear sRGB to CIE XYZ; its rows add up to the white of D65."""


def outline(picture: np.ndarray) -> np.ndarray | None:
    """(columns,) row of the outline from the top, nan where there is none, and None where nothing
    stands out from the backdrop; picture (rows, columns, 3), 0 to 1."""
    lab = cielab(picture)
    smooth = ndimage.gaussian_filter(lab, (BLUR, BLUR, 0))
    away = np.linalg.norm(smooth - _backdrop(smooth), axis=2)
    top = slice(0, int(TOP * len(away)))
    threshold = max(LEAST_CONTRAST, NOISE * float(np.median(away[top])))
    first = _first_foreground(away > threshold)
    return None if first is None else _refined(smooth, first, top)


def cielab(picture: np.ndarray) -> np.ndarray:
    """CIELAB (rows, columns, 3) of an sRGB picture, 0 to 1, for the standard light D65 (IEC
    61966-2-1; CIE 15, the observer of 2 degrees)."""
    linear = np.where(picture > 0.04045, ((picture + 0.055) / 1.055) ** 2.4, picture / 12.92)
    xyz = linear @ TO_XYZ.T / TO_XYZ.sum(axis=1)
    f = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz * (29 / 6) ** 2 / 3 + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def _backdrop(lab):
    """The backdrop's colour at each pixel: a quadratic surface through the margins, outliers left
    out twice."""
    rows, columns = lab.shape[:2]
    y, x = np.linspace(-1.0, 1.0, rows)[:, None], np.linspace(-1.0, 1.0, columns)
    margin = np.zeros((rows, columns), bool)
    margin[: int(TOP * rows)] = True
    side = max(int(SIDES * columns), 1)
    margin[: rows // 2, :side] = margin[: rows // 2, -side:] = True
    used = np.flatnonzero(margin.ravel())[::7]  # a sample is enough for six terms
    row, column = np.divmod(used, columns)
    a = np.stack(_quadratic(x[column], y[row, 0]), axis=1)
    b = lab.reshape(-1, 3)[used]
    for _ in range(3):
        fit = np.linalg.lstsq(a, b, rcond=None)[0]
        off = np.linalg.norm(b - a @ fit, axis=1)
        kept = off <= 3.0 * np.median(off) + 1e-9
        a, b = a[kept], b[kept]
    surface = np.zeros(lab.shape)
    for term, colour in zip(_quadratic(x, y), fit, strict=True):  # never all terms of all pixels
        surface += term[..., None] * colour
    return surface


def _quadratic(x, y):
    """The six terms of a quadratic surface at places x, y, each of their common shape."""
    shape = np.broadcast_shapes(np.shape(x), np.shape(y))
    return [np.broadcast_to(t, shape) for t in (1.0, x, y, x * x, x * y, y * y)]


def _first_foreground(there):
    """(columns,) first row from the top of the largest thing before the backdrop, nan where there
    is none of it, and None without a thing."""
    labels, _ = ndimage.label(there, np.ones((3, 3)))
    sizes = np.bincount(labels.ravel())[1:]
    if not len(sizes) or sizes.max() < 0.01 * there.size:
        return None
    mask = labels == 1 + int(np.argmax(sizes))
    found = mask.any(axis=0)
    return np.where(found, mask.argmax(axis=0), np.nan)


def _refined(lab, first, backdrop):
    """The outline to a part of a pixel: the first steep edge at or below `first`.

    Only the change down a column counts: a stripe of the backdrop is soft along it, a flank is not.
    """
    parts = (ndimage.gaussian_filter1d(lab[..., k], BLUR, axis=0, order=1) for k in range(3))
    steep = np.sqrt(sum(p * p for p in parts))
    columns = np.flatnonzero(np.isfinite(first))
    starts = {c: max(int(first[c]) - 8, 0) for c in columns}
    usual = np.median([steep[starts[c] :, c].max() for c in columns])
    least = max(STEEP * usual, NOISE * float(np.median(steep[backdrop])))
    rows = np.full(len(first), np.nan)
    for c in columns:
        rows[c] = starts[c] + _first_peak(steep[starts[c] :, c], least)
    rows[columns] = ndimage.median_filter(rows[columns], MEDIAN, mode="nearest")
    return rows


def _first_peak(values, least):
    """Place of the first local maximum of at least `least`, to a part of a step. If there is none,
    the place of the largest value."""
    inner = values[1:-1]
    peaks = 1 + np.flatnonzero((inner >= values[:-2]) & (inner > values[2:]) & (inner >= least))
    k = int(peaks[0]) if len(peaks) else int(np.argmax(values))
    if not 0 < k < len(values) - 1:
        return float(k)
    before, at, after = values[k - 1 : k + 2]
    bend = before - 2.0 * at + after
    return k + (0.5 * (before - after) / bend if bend < 0 else 0.0)


FIT = ".fit.png"
"""Ending of the picture of a fit, which stands beside its photograph."""
OUTLINE, FLANK, BASE = (255, 210, 0), (214, 40, 40), (30, 120, 220)


def read_photos(paths: Sequence[Path], view: View = LEVEL) -> tuple[list[HeapPhoto], list[str]]:
    """(photographs as they were read, sentences): pictures of fits, which a pattern such as *.png
    catches too, are left out and named. Raises ConfigError where nothing else is given, and for a
    photograph that is given twice, under another name too: it is no second reading."""
    kept = [p for p in paths if not p.name.endswith(FIT)]
    left = ", ".join(p.name for p in paths if p not in kept)
    if not kept:
        raise refused("fits alone", names=left)
    seen: dict[str, Path] = {}
    for path in (p for p in kept if p.is_file()):  # what cannot be read is told by its reader
        first = seen.setdefault(digest_of(path), path)
        if first is not path:
            raise refused("same photograph", path, first=first)
    said = [f"left out, as pictures of a fit: {left}"] if left else []
    return [measure_photo(p, view) for p in kept], said


def measure_photos(
    paths: Sequence[str | Path],
    out: Path | None = None,
    scale: str | None = None,
    shown: Path | None = None,
    camera: str | None = None,
    plumb: str | None = None,
    focal: str | None = None,
) -> list[str]:
    """Lines to print: each photograph's angle, then all of them. Writes the table `out` and a
    picture a photo.

    scale: a length over its pixels, `100mm/830`; camera, plumb, focal: how the camera stood, as
    `view_of` takes it. Raises ConfigError.
    """
    view = view_of(camera, plumb, focal)
    if out is not None and out.exists():
        raise refused("exists", out)
    per_pixel = told("--scale", scale, _mm_per_pixel)
    photos, lines = read_photos([Path(p) for p in paths], view)
    heights = []
    for photo in photos:
        fit = (shown or photo.path.parent) / f"{photo.path.stem}{FIT}"
        draw_fit(photo, fit)
        height = photo.height * photo.reduced * per_pixel if per_pixel else None
        more = f", {height:.1f} mm high" if height else ""
        if photo.pitch_deg is not None:
            more = f", looks down by {photo.pitch_deg:.1f}°, which is corrected{more}"
        lines.append(
            f"{photo.path.name}: {photo.angle_deg:.2f}° (left {photo.left_deg:.2f}°, right "
            f"{photo.right_deg:.2f}°, camera tilted by {photo.tilt_deg:.1f}°{more}); see {fit}"
        )
        heights.append(height)
    lines.append(summary([p.angle_deg for p in photos], "°"))
    if not view.known:
        lines.append(uncorrected([p.angle_deg for p in photos]))
    if out is not None:
        write_table(_table(photos, heights), out)
        lines.append(f"wrote {out}; in a configuration: measurements: {out}")
    return lines


def uncorrected(angles: Sequence[float]) -> str:
    """Return what a camera that looks down would do to heaps of these angles [deg], in words."""
    mean = sum(angles) / len(angles)
    low = " and ".join(f"{read_low(mean, pitch):.1f}° at {pitch}°" for pitch in (5, 10))
    return (
        "not corrected for a camera that looks down: far away it reads such a heap too flat by "
        f"{low}; --camera DISTANCE/HEIGHT or --plumb corrects it"
    )


def _table(photos, heights):
    """The angles, and the heights where they are known, as a table of measurements."""
    notes = [f"{p.path.name}: left {p.left_deg:.3f}, right {p.right_deg:.3f}" for p in photos]
    angles = [round(p.angle_deg, 3) for p in photos]
    table = readings_table("heap", "angle_of_repose", angles, "deg", notes)
    if None in heights:
        return table
    tall = readings_table("heap", "height", [round(h, 3) for h in heights], "mm", notes)
    return pd.concat([table, tall], ignore_index=True)


def _mm_per_pixel(scale):
    length, _, pixels = scale.rpartition("/")
    found = said_number(length, "mm") / float(pixels)
    return found if 0.0 < found < 1e3 else None


def draw_fit(photo: HeapPhoto, out: str | Path) -> None:
    """Write the picture with outline, base line and flanks to `out`."""
    image = open_picture(photo.path)
    image = image.resize([max(round(s / photo.reduced), 1) for s in image.size])
    draw = ImageDraw.Draw(image)
    width = max(2, image.width // 400)
    draw.point([tuple(p) for p in photo.outline], fill=OUTLINE)
    draw.line(photo.base, fill=BASE, width=width)
    font = ImageFont.load_default(size=max(14, image.width // 40))
    for line, angle in zip(photo.flanks, (photo.left_deg, photo.right_deg), strict=True):
        draw.line(line, fill=FLANK, width=width)
        draw.text(line[0], f"{angle:.1f}°", font=font, fill=FLANK, anchor="mb")
    replace_file(out, lambda stream: image.save(stream, "PNG"))
