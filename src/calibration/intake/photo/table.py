"""Several photographs: their angles as a table of measurements, and the pictures that show the fit:
outline, base line and flanks."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from PIL import ImageDraw, ImageFont

from calibration.errors import CalibrationError, ConfigError
from calibration.files import replacing, write_table
from calibration.intake.measurements import readings_table
from calibration.intake.numbers_with_units import said_number
from calibration.intake.photo.camera import View, read_low, told, view_of
from calibration.intake.photo.measure import LEVEL, HeapPhoto, measure_photo, open_picture
from calibration.intake.tables import summary
from dem.io.checked import digest_of

FIT = ".fit.png"
"""Ending of the picture of a fit, which stands beside its photograph."""
OUTLINE, FLANK, BASE = (255, 210, 0), (214, 40, 40), (30, 120, 220)


def read_photos(paths: Sequence[Path], view: View = LEVEL) -> tuple[list[HeapPhoto], list[str]]:
    """(photographs as they were read, sentences): pictures of fits, which a pattern such as *.png
    catches too, are left out and named. Raises CalibrationError where nothing else is given, and
    for a photograph that is given twice, under another name too: it is no second reading."""
    kept = [p for p in paths if not p.name.endswith(FIT)]
    left = [p.name for p in paths if p not in kept]
    said = f"left out, as pictures of a fit: {', '.join(left)}"
    if not kept:
        raise CalibrationError(f"{said}; allowed: the photographs beside them")
    seen: dict[str, Path] = {}
    for path in (p for p in kept if p.is_file()):  # what cannot be read is told by its reader
        first = seen.setdefault(digest_of(path), path)
        if first is not path:
            reason = f"is the same photograph as {first}"
            raise ConfigError(reason, path=path, allowed="each heap once")
    return [measure_photo(p, view) for p in kept], [said] if left else []


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
    `view_of` takes it. Raises CalibrationError.
    """
    view = view_of(camera, plumb, focal)
    if out is not None and out.exists():
        raise CalibrationError(f"{out}: exists already")
    per_pixel = told("scale", scale, _mm_per_pixel, "is no length over pixels; allowed: 100mm/830")
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
    with replacing(out) as partial:
        image.save(partial)
