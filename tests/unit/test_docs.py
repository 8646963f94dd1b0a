"""The site builds without a warning and its reference holds every key; what a page names exists:
files, links, commands and tests."""

import csv
import json
import re

import pytest

from calibration.study.config import Config, section_of
from dem.experiments import experiments
from dem.spec import RunSpec
from facts import ROOT
from started import python

PAGES = [ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("config/*.md")]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    python(ROOT, *"-m mkdocs build --strict --site-dir".split(), folder)
    return folder


def leaves(model, prefix=""):
    """Dotted keys of a schema that are no mappings themselves."""
    for name, field in model.model_fields.items():
        part = section_of(field.annotation)
        if part:
            yield from leaves(part, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}"


@pytest.mark.slow
def test_the_reference_has_what_the_sources_say(site):
    """Every key, command, experiment and place that starts code, and the verification's topics."""
    schema = json.loads((ROOT / "src/diagnosis/verdict.schema.json").read_text())
    with open(ROOT / "docs/starts_code.csv", encoding="utf-8") as table:
        starts = [row["name"] for row in csv.DictReader(table)]
    topics = {r["topic"] for r in json.loads((ROOT / "docs/verification.json").read_text())}
    wanted = {
        "configuration": [f"<code>{k}</code>" for k in leaves(Config)],
        "run_spec": [f"<code>{k}</code>" for k in leaves(RunSpec) if k != "geometry"],
        "verdict": [f"<code>{k}</code>" for k in schema["properties"]],
        "starts-code": [f"<code>{name}</code>" for name in starts],
        "verification": [f"{t[0].upper()}{t[1:]}<" for t in topics],
        "command": [f"usage: dem {name} " for name in ("run", "render", "check", "init", "new")],
        "experiments": [f"experiment_{name}/" for name in experiments()],
    } | {
        f"experiment_{name}": [f"geometry.{key}" for key in e.geometry.model_fields]
        + [m.name for m in e.metrics]
        for name, e in experiments().items()
    }
    for page, words in wanted.items():
        text = (site / "reference" / page / "index.html").read_text()
        assert [w for w in words if w not in text] == [], page


def test_files_and_links_of_the_pages_exist():
    missing = []
    for page in PAGES:
        text = page.read_text()
        named = re.findall(
            r"`((?:src|config|docs|examples|workflow|tests|profiles|data)/[\w./-]+)`", text
        )
        missing += [(page.name, name) for name in named if not (ROOT / name.rstrip("/.")).exists()]
        links = re.findall(r"(?<=\]\()([^)#\s]+)", text)
        local = [link for link in links if ":" not in link and "reference/" not in link]
        missing += [(page.name, link) for link in local if not (page.parent / link).exists()]
    assert missing == []
