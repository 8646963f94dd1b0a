"""The site builds without a warning, its reference holds every key, and its links into the project
exist."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from calibration.config import Config, section_of
from dem.spec import RunSpec

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict"]
    done = subprocess.run(
        [*command, "--site-dir", folder], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


def leaves(model, prefix=""):
    """Dotted keys of a schema that are no mappings themselves."""
    for name, field in model.model_fields.items():
        part = section_of(field.annotation)
        if part:
            yield from leaves(part, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}"


@pytest.mark.parametrize(("page", "model"), [("configuration", Config), ("run_spec", RunSpec)])
def test_the_reference_has_every_key(site, page, model):
    text = (site / "reference" / page / "index.html").read_text()
    missing = [k for k in leaves(model) if k != "geometry" and f"<code>{k}</code>" not in text]
    assert not missing


def test_the_reference_is_made_from_the_docstrings(site):
    text = (site / "reference" / "engine" / "index.html").read_text()
    assert "Angle of repose of a heap of spheres on a disc" in text
    text = (site / "reference" / "calibration" / "index.html").read_text()
    assert "All points of the cube" in text


@pytest.mark.parametrize(
    "page",
    sorted(
        p.relative_to(ROOT).as_posix() for p in [*ROOT.glob("docs/*.md"), ROOT / "config/README.md"]
    ),
)
def test_files_that_a_page_names_exist(page):
    text = (ROOT / page).read_text()
    named = re.findall(
        r"`((?:src|config|docs|examples|workflow|tests|profiles|data)/[\w./-]+)`", text
    )
    missing = [name for name in named if not (ROOT / name.rstrip("/.")).exists()]
    assert not missing
