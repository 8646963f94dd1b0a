"""Sliding angles out of an inclinometer's log: a line `slides at 24.3 deg` for each trial."""

from statistics import fmean

from calibration.errors import CalibrationError, ConfigError
from calibration.files import write_table
from calibration.intake.measurements import readings_table
from dem.units import UnitError, in_unit

MARK = "slides at"


def measure_tilts(path, out=None):
    """Lines to print; writes the table `out` of sliding angles. Raises CalibrationError."""
    if out is not None and out.exists():
        raise CalibrationError(f"{out}: exists already")
    angles, notes = zip(*read_angles(path), strict=True)
    lines = [f"{path.name}: {len(angles)} angles, mean {fmean(angles):.4g} deg"]
    if out is not None:
        write_table(readings_table("tilt", "sliding_angle", angles, "deg", notes), out)
        lines.append(f"wrote {out}: rows for the study's table of measured values")
    return lines


def read_angles(path):
    """[(angle [deg], where it stands)] of a log. Raises ConfigError for one without a trial and for
    a trial without an angle."""
    found = []
    for line, text in enumerate(path.read_text("utf-8").splitlines(), 1):
        if MARK in text:
            value = text.split(MARK)[1].strip()
            try:
                angle = in_unit(value, "°")
            except UnitError as error:
                raise ConfigError(str(error), path=path, line=line, value=value) from None
            if not 0.0 < angle < 90.0:
                allowed = "an angle between 0 and 90 deg"
                raise ConfigError("is no tilt", path=path, line=line, value=value, allowed=allowed)
            found.append((angle, f"{path.name}, line {line}"))
    if not found:
        raise ConfigError("has no trial", path=path, allowed=f"lines `{MARK} 24.3 deg`")
    return found
