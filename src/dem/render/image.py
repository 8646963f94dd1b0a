"""The image of a finished run; a heap with the lines that its angle of repose was read from."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from dem.errors import DemError
from dem.experiments import experiment_of
from dem.measure.heap import LOWER, UPPER, VIEWS, fit_flank, heap_grains, outline
from dem.render.files import FinishedRun
from dem.render.raster import View, shade
from dem.spec import RunSpec

GROUND, INK, LINE, STEEL = (240, 242, 245), (29, 36, 48), (209, 60, 31), (120, 128, 140)
OVERSAMPLING = 2
ROOM = 0.16  # for the labels above and below, in image widths
LABELS = {
    "size": ("diameter [mm]", "viridis", lambda run: 2e3 * run.radius),
    "speed": ("speed [m/s]", "YlOrRd", lambda run: np.linalg.norm(run.velocity, axis=1)),
    "order": ("poured first to last", "viridis", lambda run: _rank(run.tag)),
    "height": ("height [mm]", "cividis", lambda run: 1e3 * run.position[:, 2]),
}
"""What the colour of a grain tells: its label, its colours, and the values of a run's grains (n,)
in the label's unit."""
FORMATS: dict[str, dict] = {
    ".webp": {"quality": 82, "method": 4}, ".png": {"optimize": True}, ".jpg": {"quality": 88},
}  # fmt: skip


@dataclass(frozen=True)
class Flank:
    """A fitted flank: its angle [deg] and its ends (2,) [m], distance from the axis (signed) and
    height."""

    angle_deg: float
    begin: tuple
    end: tuple


def draw_run(
    run: FinishedRun,
    width: int = 800,
    colour: str = "auto",
    azimuth: float | None = None,
    elevation: float = 0.0,
) -> Any:
    """`PIL.Image` of a `FinishedRun`, `width` [px] wide; angles of the view [deg].

    A heap with an angle seen from the side (elevation 0) has its fitted flanks drawn; unless
    `azimuth` is given it is seen from where its two flanks come nearest to the run's angle of
    repose. `colour` is a key of LABELS; auto is size where sizes differ, speed where grains move,
    else order. Raises DemError for a run that kept no grain.
    """
    if not len(run.radius):
        raise DemError(f"{run.folder}: no grain is left to be drawn")
    plate = plate_of(run.spec)
    heap = plate is not None and "angle_of_repose_deg" in run.metrics
    if heap:  # without what hangs in the funnel and would make the heap small, or falls beside it
        part = heap_grains(run.position, run.radius, run.velocity, plate)  # type: ignore[arg-type]
        kept = {k: getattr(run, k)[part] for k in ("position", "radius", "velocity", "tag")}
        run = replace(run, **kept)
    if azimuth is None:
        azimuth = _telling_view(run, plate) if heap else 0.0
    view = frame(run.position, run.radius, plate, OVERSAMPLING * width, azimuth, elevation)
    if colour != "auto":
        quantity = colour
    elif np.ptp(run.radius) > 1e-6 * run.radius.max():
        quantity = "size"
    else:
        quantity = "speed" if LABELS["speed"][2](run).max() > 0.1 else "order"
    values = LABELS[quantity][2](run)
    limits = float(values.min(initial=0.0 if quantity == "speed" else np.inf)), float(values.max())
    image = paint(view, run.position, run.radius, _colours_of(quantity, values, limits), plate)
    draw = ImageDraw.Draw(image)
    if heap and elevation == 0.0:
        _draw_flanks(draw, view, run, plate)
    font = font_of(view.width)
    place = 0.02 * view.width, view.height - 1.9 * font.size
    _draw_bar(draw, quantity, limits, place, (view.width // 8, int(0.8 * font.size)), font)
    return image.resize((width, view.height // OVERSAMPLING), Image.Resampling.LANCZOS)


def _rank(tag):
    """Place (n,) of each grain in the order in which they were made, from 0 to 1."""
    return np.argsort(np.argsort(tag)) / max(len(tag) - 1, 1)


def _colours_of(quantity, values, limits):
    """Colours (n, 3) in 0..1 of values between limits (low, high)."""
    low, high = limits
    share = np.clip((values - low) / (high - low), 0.0, 1.0) if high > low else 0.5 + 0.0 * values
    return mpl.colormaps[LABELS[quantity][1]](share)[:, :3]


def _draw_bar(draw, quantity, limits, at, size, font):
    """Draw the colour bar with its label and its ends at (x, y) [px], `size` (width, height)
    [px]."""
    (x, y), (width, height) = at, size
    ramp = _colours_of(quantity, np.linspace(0.0, 1.0, width), (0.0, 1.0))
    for k, colour in enumerate(ramp):
        draw.line([x + k, y, x + k, y + height], fill=tuple(int(255 * c) for c in colour))
    text = LABELS[quantity][0]
    if quantity != "order":
        text = f"{limits[0]:.3g} to {limits[1]:.3g}  {text}"
    draw.text((x + width + height, y + height / 2), text, font=font, fill=INK, anchor="lm")


def plate_of(spec: RunSpec) -> float | None:
    """Radius [m] of the disc that a run's heap stands on; None where its last state is no heap."""
    find = experiment_of(spec).heap_plate
    return find(spec) if find else None


def paint(
    view: View,
    position: np.ndarray,
    radius: np.ndarray,
    colour: np.ndarray,
    plate_radius: float | None = None,
) -> Any:
    """`PIL.Image` of grains, colour (n, 3), and of a plate; positions and radii [m]."""
    lit, covered = shade(view, position, radius, colour, plate_radius)
    ground = np.array(GROUND) / 255.0
    blended = covered[..., None] * lit + (1.0 - covered[..., None]) * ground
    image = Image.fromarray((255.0 * blended + 0.5).astype(np.uint8))
    if plate_radius and view.elevation == 0.0:
        edge = [(-plate_radius, 0.0), (plate_radius, -1.5e-3)]
        ends = [pixel(view, *p) for p in edge]
        ImageDraw.Draw(image).rectangle(ends, fill=STEEL)
    return image


def pixel(view: View, across: float, height: float, toward: float = 0.0) -> tuple[float, float]:
    """Column and row of the point at signed distances from the axis [m] across the view and towards
    the viewer."""
    right, _, _ = view.axes
    away = np.array([right[1], -right[0], 0.0])
    column, row, _ = view.project(across * right + toward * away + [0.0, 0.0, height])
    return float(column[0]), float(row[0])


def font_of(width: float) -> Any:
    """Font for an image of `width` [px]."""
    return ImageFont.load_default(size=0.027 * width)


def save_image(image: Any, path: Path) -> None:
    """Write an image to `path`, atomically. Raises DemError for a suffix that is none of
    FORMATS."""
    if path.suffix not in FORMATS:
        raise DemError(f"{path}: is no image that can be written; allowed: {', '.join(FORMATS)}")
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial.{path.name}")
    image.save(partial, **FORMATS[path.suffix])  # type: ignore[arg-type]
    partial.replace(path)


def frame(
    position: np.ndarray,
    radius: np.ndarray,
    plate: float | None,
    width: int,
    azimuth: float,
    elevation: float,
) -> View:
    """A view that holds the grains, and the plate where there is one, with room for the labels.
    position (n, 3), radius (n,), plate [m]; width [px]; angles [deg]."""
    view = View(azimuth, elevation, 1.0, (0.0, 0.0, 0.0), 0, 0)
    corners = np.vstack([position - radius[:, None], position + radius[:, None]])
    if plate:
        ring = np.radians(np.arange(0.0, 360.0, 5.0))
        rim = np.column_stack([plate * np.cos(ring), plate * np.sin(ring), 0.0 * ring])
        corners = np.vstack([corners, rim])
    across, down, _ = view.project(corners)
    reach = max(float(np.ptp(across)), 1e-3)
    scale = width / (1.12 * reach)
    height = int(scale * float(np.ptp(down)) + ROOM * width) // 4 * 4
    middle = 0.5 * (across.min() + across.max()), -0.5 * (down.min() + down.max()), 0.0
    return replace(
        view, scale=scale, centre=tuple(np.array(middle) @ view.axes), width=width, height=height
    )


def _telling_view(run, plate):
    """Azimuth [deg] whose flanks come nearest to the run's angle of repose."""

    def distance(azimuth):
        flanks = fitted_flanks(run.position, run.radius, plate, azimuth)
        if None in flanks:
            return np.inf
        return max(abs(f.angle_deg - run.metrics["angle_of_repose_deg"]) for f in flanks)

    return min(180.0 * np.arange(VIEWS) / VIEWS, key=distance)


def fitted_flanks(
    position: np.ndarray, radius: np.ndarray, plate_radius: float, azimuth: float
) -> list[Flank | None]:
    """The flanks left and right, each a `Flank` or None, of the silhouette seen at `azimuth` [deg].

    Both angles are `dem.measure.heap.fit_flank`'s; the line runs through the mean of the points it
    was fitted to. position (n, 3), radius (n,) [m].
    """
    turn = np.radians(azimuth)
    across = position[:, 0] * np.cos(turn) + position[:, 1] * np.sin(turn)
    stations = np.arange(0.0, plate_radius, 0.25 * float(np.mean(radius)))
    limit = plate_radius - float(np.mean(radius))
    sides = ((s, outline(s * across, position[:, 2], radius, stations)) for s in (-1.0, 1.0))
    return [_segment(stations, profile, limit, side) for side, profile in sides]


def _segment(distance, height, limit, side):
    angle = fit_flank(distance, height, limit)
    if not np.isfinite(angle):
        return None
    top, slope = float(height.max()), -np.tan(np.radians(angle))
    flank = (distance <= limit) & (height <= UPPER * top) & (height >= LOWER * top)
    flank &= distance > distance[(distance <= limit) & (height > UPPER * top)].max(initial=0.0)
    x, y = float(distance[flank].mean()), float(height[flank].mean())
    ends = [(side * (x + (level - y) / slope), level) for level in (1.05 * top, 0.0)]
    return Flank(angle, *ends)


def _draw_flanks(draw, view, run, plate):
    flanks = fitted_flanks(run.position, run.radius, plate, view.azimuth)
    font, thick = font_of(view.width), max(view.width // 250, 2)
    for flank in filter(None, flanks):
        ends = pixel(view, *flank.begin), pixel(view, *flank.end)
        draw.line(ends, fill=LINE, width=thick)
        side, anchor = (1, "lm") if flank.end[0] > 0 else (-1, "rm")
        middle = [0.5 * (a + b) for a, b in zip(flank.begin, flank.end, strict=True)]
        x, y = pixel(view, *middle)
        at = x + side * font.size, y - font.size
        draw.text(at, f"{flank.angle_deg:.1f}°", font=font, fill=LINE, anchor=anchor)
    m = run.metrics
    text = f"angle of repose {m['angle_of_repose_deg']:.1f}°, mean of {2 * VIEWS} flanks"
    if m.get("in_funnel"):
        text += f"; {m['in_funnel']} grains left in the funnel"
    draw.text((0.02 * view.width, 0.8 * font.size), text, font=font, fill=INK)
