"""Several photographs: their angles as a table of measurements, and the pictures that show the
fit."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from calibration.errors import CalibrationError
from calibration.files import write_table
from calibration.intake.measurements import readings_table
from calibration.intake.photo.measure import measure_photo
from calibration.intake.photo.show import draw_fit
from calibration.intake.tables import summary
from dem.units import UnitError, in_unit


def measure_photos(
    paths: Sequence[str | Path],
    out: Path | None = None,
    scale: str | None = None,
    shown: Path | None = None,
) -> list[str]:
    """Lines to print: each photograph's angle, then all of them. Writes the table `out` and a
    picture a photo.

    scale: a length over its pixels, `100mm/830`. Raises CalibrationError.
    """
    if out is not None and out.exists():
        raise CalibrationError(f"{out}: exists already")
    per_pixel = _mm_per_pixel(scale) if scale else None
    photos, lines, heights = [measure_photo(p) for p in paths], [], []
    for photo in photos:
        fit = (shown or photo.path.parent) / f"{photo.path.stem}.fit.png"
        draw_fit(photo, fit)
        height = photo.height * photo.reduced * per_pixel if per_pixel else None
        tall = f", {height:.1f} mm high" if height else ""
        lines.append(
            f"{photo.path.name}: {photo.angle_deg:.2f}° (left {photo.left_deg:.2f}°, right "
            f"{photo.right_deg:.2f}°, camera tilted by {photo.tilt_deg:.1f}°{tall}); see {fit}"
        )
        heights.append(height)
    lines.append(summary([p.angle_deg for p in photos], "°"))
    if out is not None:
        write_table(_table(photos, heights), out)
        lines.append(f"wrote {out}; in a configuration: measurements: {out}")
    return lines


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
        found = in_unit(length, "mm") / float(pixels)
    except (UnitError, ValueError, ZeroDivisionError):
        found = 0.0
    if not 0.0 < found < 1e3:
        raise CalibrationError(f"--scale {scale}: is no length over pixels; allowed: 100mm/830")
    return found
