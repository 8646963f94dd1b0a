"""The studies by which the tables of `foreign/` are diagnosed, as studies.yaml there has them."""

from pathlib import Path
from typing import Any

import yaml

from calibration.study.config import overlay

TABLES = Path(__file__).with_name("foreign")


def read(name: str) -> dict[str, Any]:
    """Return the content of a YAML file of `foreign/`."""
    return yaml.safe_load((TABLES / name).read_text())


OF_FOREIGN = read("studies.yaml")
FACTORS = (TABLES / "factors.tsv").read_text()
FIXED: dict[str, float] = OF_FOREIGN["fixed"]
MATERIALS: dict[str, Any] = OF_FOREIGN["materials"]
RUN: dict[str, Any] = OF_FOREIGN["run"]
STUDIES: dict[str, dict[str, Any]] = OF_FOREIGN["studies"]


def filled(run, diameter_mm):
    """A run with grains of another size, of the same volume together: what a vessel or a funnel is
    filled with, of any grains."""
    grains = run["particles"]
    count = round(grains["count"] * (grains["diameter_mm"] / diameter_mm) ** 3)
    return overlay(run, {"particles": {"count": count, "diameter_mm": diameter_mm}})


def study(name, what, measurements, runs):
    """Configuration of the diagnosis of a table."""
    return what | {
        "name": name,
        "factors": "factors.tsv",
        "measurements": str(measurements),
        "fixed": FIXED,
        "diagnosis": {"runs": runs, "batches": 2},
    }
