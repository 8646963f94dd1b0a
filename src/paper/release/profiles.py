"""What the reduced profiles and softer grains cost, for `docs/salt-study.md`, from the study of the
numerics; `profiles.md.j2` has the words."""

from pathlib import Path
from typing import Any

from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed
from paper.release.softening import STIFFER, softening

FULL, QUICK, TEST = "full scale", "quick profile", "test profile"


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} of `profiles.md.j2`, from the folder of a kept study."""
    table = read_written(Path(kept) / "numerics" / "numerics.csv")
    of = {name: table[table["variant"] == name] for name in (FULL, QUICK, TEST, STIFFER)}
    stiffer = of[STIFFER]
    return {
        "points": list(of[FULL]["point"]),
        "full": ", ".join(f"{angle:.1f}°" for angle in of[FULL]["mean"]),
        "quick": _apart(of[QUICK]),
        "test": _apart(of[TEST]),
        "seeds": {name: int(of[name]["n"].max()) for name in of},
        "good_to": {name: _half_width(of[name]) for name in (QUICK, TEST)},
        "softening": softening(table),
        "exceeds": list(stiffer.loc[stiffer["within_seed_spread"].astype(str) != "True", "point"]),
        "spread": f"{of[FULL]['sd'].min():.1f}° to {of[FULL]['sd'].max():.1f}°",
    }


def _apart(rows):
    return ", ".join(f"{fixed(d, 1, '+')}°".replace("-", "−") for d in rows["difference"])


def _half_width(rows):
    """The widest half of an interval of these differences, in degrees."""
    return f"{(0.5 * (rows['high'] - rows['low'])).max():.1f}°"
