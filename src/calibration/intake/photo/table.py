"""Several photographs: their angles as a table of measurements, and the pictures that show the fit:
outline, base line and flanks."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from PIL import ImageDraw, ImageFont

from calibration.errors import CalibrationError
from calibration.files import replacing, write_table
from calibration.intake.measurements import readings_table
from calibration.intake.numbers_with_units import said_number
from calibration.intake.photo.camera import View, read_low
from calibration.intake.photo.measure import LEVEL, HeapPhoto, measure_photo, open_picture
from calibration.intake.photo_names import FIT, refuse_twice, without_fits
from calibration.intake.tables import summary
from dem.units import UnitError

OUTLINE, FLANK, BASE = (255, 210, 0), (214, 40, 40), (30, 120, 220)


def measure_photos(
    paths: Sequence[str | Path],
    out: Path | None = None,
    scale: str | None = None,
    shown: Path | None = None,
    view: View = LEVEL,
) -> list[str]:
    """Lines to print: each photograph's angle, then all of them. Writes the table `out` and a
    picture a photo.

    scale: a length over its pixels, `100mm/830`; view: how the camera stood, where it was told.
    Raises CalibrationError.
    """
    if out is not None and out.exists():
        raise CalibrationError(f"{out}: exists already")
    per_pixel = _mm_per_pixel(scale) if scale else None
    names, lines = without_fits([Path(p) for p in paths])
    refuse_twice(names)
    photos, heights = [measure_photo(p, view) for p in names], []
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
    """What a camera that looks down would do to heaps of these angles [deg], in words."""
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
    try:
        found = said_number(length, "mm") / float(pixels)
    except (UnitError, ValueError, ZeroDivisionError):
        found = 0.0
    if not 0.0 < found < 1e3:
        raise CalibrationError(f"--scale {scale}: is no length over pixels; allowed: 100mm/830")
    return found


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
