"""What is released and what it is built on: one version everywhere, packages that are pinned within
their bounds and have a free licence, an installation of a bounded size, and no network while a run
or a dry run is made."""

import importlib.util
import json
import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
LOCKS = ("requirements.lock", "requirements-dev.lock")
PIN = r"[A-Za-z0-9._-]+==[A-Za-z0-9.!+]+( ; [^\\]+)? \\"
HASH = r"    --hash=sha256:[0-9a-f]{64}( \\)?"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OWN = canonicalize_name(PROJECT["name"])
MOST = 600.0
"""Of an installation [MiB of files], without the bytecode that pip writes unless told not to."""


def test_the_version_is_the_same_everywhere():
    stated = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.M)[1]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    newest = re.findall(r"^## (\d\S*)", (ROOT / "CHANGELOG.md").read_text(), re.M)[0]
    assert citation["version"] == stated
    assert newest == stated
    assert f"granular_calibration-{stated}-py3" in (ROOT / "docs/install.md").read_text()


def hook():
    """docs/licences.py, which no package holds."""
    spec = importlib.util.spec_from_file_location("licences", ROOT / "docs" / "licences.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


LICENCES = hook()
PINNED = {canonicalize_name(name): version for name, version in LICENCES.locked().items()}


def direct():
    """Requirements of the project and of its extras."""
    extras = PROJECT["optional-dependencies"]
    texts = [*PROJECT["dependencies"], *(text for extra in extras.values() for text in extra)]
    found = map(Requirement, texts)
    return [r for r in found if canonicalize_name(r.name) != OWN]


def test_a_lock_names_versions_and_checksums_alone():
    """No address, no host, no other option: where packages come from is the user's affair."""
    for lock in LOCKS:
        before = ""
        for line in (ROOT / lock).read_text().splitlines():
            if not line.startswith("#"):
                assert re.fullmatch(HASH if before.endswith("\\") else PIN, line), line
            before = line


def test_what_is_required_is_pinned_within_its_bound():
    for requirement in direct():
        pinned = PINNED.get(canonicalize_name(requirement.name))
        assert pinned, f"{requirement} is in no lock"
        assert pinned in requirement.specifier, requirement
        assert [s for s in requirement.specifier if s.operator == ">="], requirement


def needed(packages):
    """Names of packages and of all that they need here, as far as they are installed."""
    todo, seen = [(p, frozenset()) for p in packages], set()
    while todo:
        name, extras = todo.pop()
        if (name, extras) in seen:
            continue
        seen.add((name, extras))
        try:
            requires = distribution(name).requires or []
        except PackageNotFoundError:
            continue
        for text in requires:
            one = Requirement(text)
            wanted = extras or {""}
            if one.marker is None or any(one.marker.evaluate({"extra": e}) for e in wanted):
                todo.append((canonicalize_name(one.name), frozenset(one.extras)))
    return {name for name, _ in seen}


def test_all_that_is_needed_is_pinned():
    every = needed(canonicalize_name(r.name) for r in direct())
    assert not every - set(PINNED) - {OWN, "pip", "setuptools"}


ALLOWED = re.compile(r"MIT|BSD|0BSD|Apache|ISC|PSF|Python Software|MPL|Mozilla|HPND|Public Domain")


def test_each_package_states_a_licence_that_lets_everybody_use_it():
    stated = {}
    for package in LICENCES.locked():
        try:
            stated[package] = LICENCES.licence_of(package)
        except PackageNotFoundError:  # of another platform
            continue
    assert len(stated) > 50
    assert {p: text for p, text in stated.items() if not ALLOWED.search(text)} == {}


def mebibytes(dist):
    """Size of a distribution's files [MiB, as du counts], its bytecode left out."""
    paths = [Path(dist.locate_file(f)) for f in dist.files or [] if f.suffix != ".pyc"]
    return sum(path.stat().st_size for path in paths if path.is_file()) / 2**20


def test_a_plain_installation_is_small():
    wanted = needed(canonicalize_name(Requirement(r).name) for r in PROJECT["dependencies"])
    sizes = {}
    for name in wanted:
        try:
            sizes[name] = mebibytes(distribution(name))
        except PackageNotFoundError:
            continue
    assert sizes["numba"] > 10.0  # the files are counted
    assert sum(sizes.values()) < MOST, sizes
    assert not {"vtk", "statsmodels", "scikit-image", "pytest", "mkdocs"} & sizes.keys()


ASKED = "NETWORK:"
BLOCKED = """
import json, socket, sys

class NoNetwork(Exception):
    pass

def refuse(event, arguments):
    if event in ("socket.connect", "socket.getaddrinfo", "socket.sendto"):
        if event == "socket.getaddrinfo" or arguments[0].family != socket.AF_UNIX:
            print("NETWORK:", event, arguments[1:], flush=True)
            sys.stdout.flush()
            raise NoNetwork(event)

sys.addaudithook(refuse)
"""
RUN = """
from dem.run import run
from dem.spec import parse_spec

drop = {"experiment": "drop", "geometry": {"drop_height_mm": 5.0, "drops": 1}}
print(json.dumps(run(parse_spec(drop), sys.argv[1])["metrics"]))
"""
PLAN = """
from snakemake.cli import main

main(["-n", "-j1", "--quiet", "all"])
"""


def without_network(script, *arguments, cwd):
    return subprocess.run(
        [sys.executable, "-c", BLOCKED + script, *map(str, arguments)],
        cwd=cwd, env=dict(os.environ), capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_a_run_asks_for_no_network(tmp_path):
    done = without_network(RUN, tmp_path / "out", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert ASKED not in done.stdout
    assert json.loads(done.stdout.splitlines()[-1])["rebound_height_mm"] > 0


@pytest.mark.slow
def test_a_dry_run_asks_for_no_network(tmp_path):
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    done = without_network(PLAN, cwd=tmp_path)
    shown = done.stdout + done.stderr
    assert done.returncode == 0, shown
    assert ASKED not in shown
