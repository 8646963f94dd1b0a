"""The studies by which the tables of `foreign/` are diagnosed, as studies.yaml there has them."""

from pathlib import Path
from typing import Any

import yaml

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
