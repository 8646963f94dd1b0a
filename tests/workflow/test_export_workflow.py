"""The stage `export` in the workflow: a target of its own that waits for the validation and plans its own runs."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def dry_run(tmp_path_factory):
    """Output of a dry run of `export` in a checkout without results."""
    clone = tmp_path_factory.mktemp("clone")
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (clone / name).symlink_to(ROOT / name)
    command = [sys.executable, "-m", "snakemake", "-n", "-j2", "export"]
    done = subprocess.run(command, cwd=clone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_the_export_waits_for_the_validation_and_its_own_search(dry_run):
    jobs = dict(re.findall(r"^(\w+) +(\d+)$", dry_run, re.M))
    for rule in (
        "plan_export_scan",
        "plan_export_confirmation",
        "export_rolling",
        "validation",
        "export",
    ):
        assert jobs.get(rule) == "1", rule


def test_the_export_names_a_file_for_each_code(dry_run):
    from calibration.export.stage import CODES

    for name in (*CODES, "dem.yaml", "study.yaml"):
        assert f"results/salt/exports/{name}" in dry_run
    assert "results/salt/calibrated.yaml" in dry_run
