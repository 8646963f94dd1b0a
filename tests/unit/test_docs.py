"""The site builds without a warning, its reference holds every key, and its links into the project
exist."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from calibration.statistics.optimise import solve
from calibration.study.config import Config, section_of
from dem.experiments import experiments
from dem.measure import heap
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


@pytest.mark.parametrize("name", sorted(experiments()))
def test_each_experiment_has_a_page_of_what_it_declares(site, name):
    e, text = experiments()[name], (site / f"reference/experiment_{name}/index.html").read_text()
    words = [f"geometry.{key}" for key in e.geometry.model_fields]
    words += [m.name for m in e.metrics] + [*e.levers, *e.mechanisms, e.title]
    assert [w for w in words if w not in text] == []
    assert f"experiment_{name}/" in (site / "reference/experiments/index.html").read_text()


def beginning(documented):
    return " ".join(documented.__doc__.split()[:5])


def test_the_reference_is_made_from_the_docstrings(site):
    text = (site / "reference" / "engine" / "index.html").read_text()
    assert beginning(heap) in text
    text = (site / "reference" / "calibration" / "index.html").read_text()
    assert beginning(solve) in text


@pytest.mark.parametrize(
    "page",
    sorted(
        p.relative_to(ROOT).as_posix() for p in [*ROOT.glob("docs/*.md"), *ROOT.glob("config/*.md")]
    ),
)
def test_files_that_a_page_names_exist(page):
    text = (ROOT / page).read_text()
    named = re.findall(
        r"`((?:src|config|docs|examples|workflow|tests|profiles|data)/[\w./-]+)`", text
    )
    missing = [name for name in named if not (ROOT / name.rstrip("/.")).exists()]
    assert not missing


def promised_tests():
    """Paths and functions of tests that the page of promises names; a path without a folder is in
    tests/unit."""
    text = (ROOT / "docs/reliability.md").read_text()
    for path in re.findall(r"`([\w./]*(?:test_\w+|kills)\.py)\b[^`]*`", text):
        yield (ROOT / "tests/unit" / path).resolve()


def test_every_promise_names_a_test_that_exists():
    rows = re.findall(
        r"^\| (?!promise|the same spec|-)(.*)\|$", (ROOT / "docs/reliability.md").read_text(), re.M
    )
    unnamed = [row for row in rows if "test_" not in row]
    # what stands outside the tests says so itself
    assert all(".ci/" in row or "no test" in row for row in unnamed), unnamed
    assert len(set(promised_tests())) > 15
    for path in promised_tests():
        assert path.is_file(), path
        assert "def test_" in path.read_text() or path.name == "kills.py", path


def test_the_readme_is_a_screen_and_a_half():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 80


def test_a_beginner_s_page_is_under_two_screens():
    assert len((ROOT / "config/README.md").read_text().splitlines()) <= 80


SOURCES = {
    "own-material": "config/README.md",
    "every-part": "config/REFERENCE.md",
    "example-soybean": "examples/soybean/README.md",
    "changelog": "CHANGELOG.md",
}


@pytest.mark.parametrize(("page", "source"), SOURCES.items())
def test_a_page_from_elsewhere_has_its_files_text(site, page, source):
    """There is one copy, which reads on a forge; the site takes it from there."""
    assert not (ROOT / "docs" / f"{page}.md").exists()
    text = re.sub(r"<[^>]+>|\s|&para;", "", (site / page / "index.html").read_text())
    headings = re.findall(r"^#+ ([\w ,:.]+)$", (ROOT / source).read_text(), re.M)
    assert len(headings) > 2
    assert not [h for h in headings if h.replace(" ", "") not in text]


def test_a_link_to_such_a_file_is_one_to_the_page_of_the_site(site):
    assert "(../config/README.md)" in (ROOT / "docs/tutorial.md").read_text()
    assert 'href="../own-material/"' in (site / "tutorial" / "index.html").read_text()


def test_the_reference_has_every_command(site):
    text = (site / "reference" / "command" / "index.html").read_text()
    for name in ("run", "render", "check", "benchmark", "init", "new", "angle"):
        assert re.search(rf"usage: dem {name}\b", text), name


@pytest.mark.parametrize("page", sorted(p.name for p in ROOT.glob("docs/*.md")))
def test_a_page_holds_its_text_and_its_links_lead_somewhere_on_a_forge(page):
    text = (ROOT / "docs" / page).read_text()
    assert len(text.split()) > 30
    links = re.findall(r"(?<=\]\()([^)#\s]+)", text)
    local = [link for link in links if ":" not in link and not link.startswith("reference/")]
    assert not [link for link in local if not (ROOT / "docs" / link).exists()]
