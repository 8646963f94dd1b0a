"""The site builds without a warning, its reference holds every key, and its links into the project
exist."""

import csv
import json
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


def test_the_reference_has_what_the_sources_say(site):
    """The schema of a verdict, what may start code, and the tables of the verification."""
    schema = json.loads((ROOT / "src/diagnosis/verdict.schema.json").read_text())
    text = (site / "reference/verdict/index.html").read_text()
    assert [key for key in schema["properties"] if f"<code>{key}</code>" not in text] == []
    text = (site / "reference/starts-code/index.html").read_text()
    with open(ROOT / "docs/starts_code.csv", encoding="utf-8") as table:
        names = [row["name"] for row in csv.DictReader(table)]
    assert [name for name in names if f"<code>{name}</code>" not in text] == []
    text = (site / "reference/verification/index.html").read_text()
    topics = {r["topic"] for r in json.loads((ROOT / "docs/verification.json").read_text())}
    assert [t for t in topics if f"{t[0].upper()}{t[1:]}<" not in text] == []


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
        r"^\| (?!promise|the same spec|-|\*\*)(.*)\|$",
        (ROOT / "docs/reliability.md").read_text(),
        re.M,
    )
    assert not [row for row in rows if "test_" not in row]
    assert len(set(promised_tests())) > 15
    for path in promised_tests():
        assert path.is_file(), path
        assert "def test_" in path.read_text() or path.name == "kills.py", path


SOURCES = {
    "own-material": "config/README.md",
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
    for name in ("run", "render", "check", "init", "new", "angle"):
        assert re.search(rf"usage: dem {name}\b", text), name


@pytest.mark.parametrize("page", sorted(p.name for p in ROOT.glob("docs/*.md")))
def test_a_page_holds_its_text_and_its_links_lead_somewhere_on_a_forge(page):
    text = (ROOT / "docs" / page).read_text()
    assert len(text.split()) > 30
    links = re.findall(r"(?<=\]\()([^)#\s]+)", text)
    local = [link for link in links if ":" not in link and not link.startswith("reference/")]
    assert not [link for link in local if not (ROOT / "docs" / link).exists()]
