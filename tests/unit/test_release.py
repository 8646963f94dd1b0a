"""What is released: one version everywhere, and no network while a run or a dry run is made. `pip`
in `.ci/run` holds that each pin has its checksum and lies within its bounds, and that none is
missing."""

import json
import re

import pytest
import yaml

from facts import ROOT
from started import python


def test_the_version_is_the_same_everywhere():
    stated = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.M)[1]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    newest = re.findall(r"^## (\d\S*)", (ROOT / "CHANGELOG.md").read_text(), re.M)[0]
    assert citation["version"] == stated
    assert newest == stated
    assert f"granular_calibration-{stated}-py3" in (ROOT / "docs/install.md").read_text()


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
    return python(cwd, "-c", BLOCKED + script, *arguments)


@pytest.mark.slow
def test_a_run_asks_for_no_network(tmp_path):
    done = without_network(RUN, tmp_path / "out", cwd=tmp_path)
    assert ASKED not in done.stdout
    assert json.loads(done.stdout.splitlines()[-1])["rebound_height_mm"] > 0


@pytest.mark.slow
def test_a_dry_run_asks_for_no_network(tmp_path):
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    done = without_network(PLAN, cwd=tmp_path)
    assert ASKED not in done.stdout + done.stderr
