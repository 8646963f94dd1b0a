"""The pour as an animation, from the frames that `dem run --frames` wrote."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw

from dem.errors import DemError
from dem.experiments.heap import HeapGeometry, Rig
from dem.io.vtk import POINTS, read_grains
from dem.render.colour import colour_by, colours_of, draw_bar, values_of
from dem.render.image import GROUND, INK, OVERSAMPLING, STEEL, font_of, frame, paint, pixel

if TYPE_CHECKING:
    from pathlib import Path

    from dem.render.files import FinishedRun


ELEVATION = 14.0
COLOURS, PALETTE_PICTURES = 160, 6  # of a GIF
FORMATS = {
    ".gif": {"optimize": True},
    ".webp": {"quality": 70, "method": 4},
    ".png": {},  # an animated PNG
}
RING = np.radians(np.arange(0.0, 361.0, 5.0))


def animate(
    run: FinishedRun,
    path: Path,
    width: int = 480,
    colour: str = "auto",
    frames_per_s: float = 20.0,
    progress: Callable[[float], object] | None = None,
) -> None:
    """Write the pour of a `FinishedRun` of a heap to `path` (.gif, .webp or .png), atomically.

    width: [px]; progress: called with the share that is done. Raises DemError without frames or for
    another suffix."""
    if path.suffix not in FORMATS:
        raise DemError(
            f"{path}: is no animation that can be written; allowed: {', '.join(FORMATS)}"
        )
    if not isinstance(run.spec.geometry, HeapGeometry):  # type: ignore[attr-defined]
        raise DemError(
            f"{run.folder}: a {run.spec.experiment} is not poured; only a heap is animated"  # type: ignore[attr-defined]
        )
    files = run.frames
    if len(files) < 2:
        raise DemError(
            f"{run.folder}: has no frames to animate; `dem run SPEC --out {run.folder} --frames "
            f"0.02` writes them"
        )
    states = [_state(f) for f in files] + [(run.position, run.radius, run.velocity, run.tag)]
    quantity = colour_by(colour, run.radius, states[len(states) // 2][2])
    shades = [values_of(quantity, *s) for s in states]
    top = float(np.percentile(np.concatenate(shades), 99.0)) if quantity == "speed" else None
    low = 0.0 if quantity == "speed" else min(v.min(initial=np.inf) for v in shades)
    limits = float(low), top or float(max(v.max(initial=-np.inf) for v in shades))
    view = _view(run, width)
    pictures = []
    for k, (state, values) in enumerate(zip(states, shades, strict=True)):
        pictures.append(_picture(view, run, state, quantity, values, limits, width))
        if progress:
            progress((k + 1) / len(states))
    _save(pictures, path, frames_per_s)


def _state(path):
    """Position, radius, velocity, tag of a frame."""
    found = read_grains(path)
    return tuple(found[name] for name in (POINTS, "radius", "velocity", "id"))


def _view(run, width):
    """Plate and funnel whole, with the mouth where grains are made."""
    rig = Rig(run.spec.geometry)
    r, h = rig.mouth_radius * np.ones_like(RING), rig.source_height * np.ones_like(RING)
    mouth = np.column_stack([r * np.cos(RING), r * np.sin(RING), h])
    return frame(mouth, 0.0 * r, rig.plate_radius, OVERSAMPLING * width, 0.0, ELEVATION)


def _picture(view, run, state, quantity, values, limits, width):
    position, radius, *_ = state
    colours = colours_of(quantity, values, limits)
    plate = 0.5e-3 * run.spec.geometry.plate_diameter_mm
    image = paint(view, position, radius, colours, plate)
    if not (run.spec.geometry.funnel_stl):
        image = _with_funnel(image, view, run.spec.geometry)
    font, draw = font_of(view.width), ImageDraw.Draw(image)
    place = 0.02 * view.width, view.height - 1.9 * font.size
    strip = [0, place[1] - 0.3 * font.size, view.width, view.height]
    draw.rectangle(strip, fill=GROUND)  # spilled grains fall behind the bar
    draw_bar(draw, quantity, limits, place, (view.width // 8, int(0.8 * font.size)), font, INK)
    return image.resize((width, view.height // OVERSAMPLING), Image.Resampling.LANCZOS)


def _with_funnel(image, view, geometry):
    """The funnel as glass: its rims and flanks, and a veil over what is in it."""
    rig = Rig(geometry)
    veil = Image.new("RGBA", image.size, (0, 0, 0, 0))
    draw = ImageDraw.Draw(veil)
    rims = [(rig.mouth_radius, rig.rim_height), (rig.orifice_radius, rig.orifice_height)]
    sides = [pixel(view, s * r, h) for s, order in ((-1, rims), (1, rims[::-1])) for r, h in order]
    draw.polygon(sides, fill=(*STEEL, 40))
    for r, h in rims:
        ring = [pixel(view, r * np.cos(a), h, r * np.sin(a)) for a in RING]
        draw.line(ring, fill=(*STEEL, 255), width=OVERSAMPLING)
    for k in (0, 2):
        draw.line(sides[k : k + 2], fill=(*STEEL, 255), width=OVERSAMPLING)
    return Image.alpha_composite(image.convert("RGBA"), veil).convert("RGB")


def _palette(pictures):
    """One palette for all, from a few of them side by side: a palette a picture would flicker."""
    few = pictures[:: max(len(pictures) // PALETTE_PICTURES, 1)]
    width, height = few[0].size
    strip = Image.new("RGB", (width * len(few), height))
    for k, picture in enumerate(few):
        strip.paste(picture, (k * width, 0))
    return strip.quantize(COLOURS, method=Image.Quantize.MEDIANCUT)


def _save(pictures, path, frames_per_s):
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial.{path.name}")
    times = [round(1000.0 / frames_per_s)] * (len(pictures) - 1) + [2000]  # the heap stays a while
    if path.suffix == ".gif":
        palette = _palette(pictures)
        pictures = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    first, *others = pictures
    first.save(
        partial, save_all=True, append_images=others, duration=times, loop=0, **FORMATS[path.suffix]
    )
    partial.replace(path)
