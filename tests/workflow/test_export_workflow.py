"""The exports in the workflow: part of all without a run of their own, and a target that searches
for other laws."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from calibration.telling.export.stage import CODES, CONVERTED
from workflow_rules import read_workflow

ROOT = Path(__file__).parents[2]
SEARCH = ("plan_export_scan", "plan_export_confirmation", "export_rolling", "export_converted")


@pytest.fixture(scope="module")
def dry_run(tmp_path_factory):
    """Function: ({rule: jobs}, output) of a dry run of targets in a checkout without results."""
    clone = tmp_path_factory.mktemp("clone")
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (clone / name).symlink_to(ROOT / name)

    def dry(*targets):
        command = [sys.executable, "-m", "snakemake", "-n", "-j2", *targets]
        done = subprocess.run(command, cwd=clone, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        text = done.stdout + done.stderr
        return dict(re.findall(r"^(\w+) +(\d+)$", text, re.M))

    return dry


def made_by(rule):
    """Names of the files that a rule of the salt's study makes, below its folder."""
    workflow = read_workflow(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)
    files = next(r for r in workflow.rules if r.name == rule).output
    return {str(f).removeprefix("results/salt/") for f in files}


def test_the_whole_study_exports_without_a_search(dry_run):
    jobs = dry_run()
    assert jobs["export"] == jobs["report"] == "1"
    assert not set(SEARCH) & set(jobs)
    made = {f"exports/{name}" for name in (*CODES, "dem.yaml", "study.yaml")}
    assert made | {"calibrated.yaml"} <= made_by("export")


def test_converted_blocks_wait_for_the_validation_and_their_own_search(dry_run):
    jobs = dry_run("export_converted")
    for rule in (*SEARCH, "validation", "export"):
        assert jobs.get(rule) == "1", rule
    assert {f"exports/converted/{name}" for name in CONVERTED} <= made_by("export_converted")
