"""What the reduced profiles cost, for docs/results.md, from the study of the numerics."""

from pathlib import Path
from typing import Any

from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed

FULL, QUICK, TEST = "full scale", "quick profile", "test profile"


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} for docs/results.md, from the folder of a kept study."""
    table = read_written(Path(kept) / "numerics" / "numerics.csv")
    of = {name: table[table["variant"] == name] for name in (FULL, QUICK, TEST)}
    return {
        "points": list(of[FULL]["point"]),
        "full": ", ".join(f"{angle:.1f}°" for angle in of[FULL]["mean"]),
        "quick": _apart(of[QUICK]),
        "test": _apart(of[TEST]),
    }


def _apart(rows):
    return ", ".join(f"{fixed(d, 1, '+')}°".replace("-", "−") for d in rows["difference"])
