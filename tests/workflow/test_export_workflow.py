"""The exports in the workflow: part of all without a run of their own, and a target that searches
for other laws."""

from pathlib import Path

import pytest

from calibration.telling.export.stage import CODES, CONVERTED
from workflow_rules import planned_jobs, read_workflow

ROOT = Path(__file__).parents[2]
SEARCH = (
    "plan_export_scan",
    "plan_export_confirmation",
    "plan_export_correction",
    "export_rolling",
    "export_converted",
)


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """A checkout without results."""
    folder = tmp_path_factory.mktemp("clone")
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (folder / name).symlink_to(ROOT / name)
    return folder


def made_by(rule):
    """Names of the files that a rule of the salt's study makes, below its folder."""
    workflow = read_workflow(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)
    files = next(r for r in workflow.rules if r.name == rule).output
    return {str(f).removeprefix("results/salt/") for f in files}


def test_the_whole_study_exports_without_a_search(clone):
    jobs = planned_jobs(clone)
    assert jobs["export"] == jobs["report"] == 1
    assert not set(SEARCH) & set(jobs)
    made = {f"exports/{name}" for name in (*CODES, "dem.yaml", "study.yaml")}
    assert made | {"calibrated.yaml"} <= made_by("export")


def test_converted_blocks_wait_for_the_validation_and_their_own_search(clone):
    jobs = planned_jobs(clone, "export_converted")
    for rule in (*SEARCH, "validation", "export"):
        assert jobs.get(rule) == 1, rule
    assert {f"exports/converted/{name}" for name in CONVERTED} <= made_by("export_converted")
