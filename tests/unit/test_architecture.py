"""Every package says what is in it, and the calibration has few names at its top."""

import importlib.util
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
MOST = 14  # names at the top of the calibration


def generator():
    """docs/every_name.py, which no package holds."""
    spec = importlib.util.spec_from_file_location("every_name", ROOT / "docs" / "every_name.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


EVERY = generator()


def test_every_name_says_what_is_in_it():
    silent = [p for package in EVERY.PACKAGES for p in EVERY.names(package)]
    assert not [str(p) for p in silent if not EVERY.sentence(p)]


def test_the_calibration_has_few_names_and_the_contract_knows_them_all():
    top = {p.stem for p in EVERY.names("calibration")}
    assert len(top) + 1 <= MOST  # and the workflow
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    [layers] = [c["layers"] for c in contracts if c.get("containers") == ["calibration"]]
    assert {name for layer in layers for name in layer.split(" | ")} == top
    assert set(EVERY.CALIBRATION) == {p.name for p in EVERY.names("calibration") if p.is_dir()}
