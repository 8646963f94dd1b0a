"""The bench tests inside the workflow: their values reach the heaps through a file, when the
configuration says so."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from calibration.chain.jobs import study_of
from calibration.chain.validation import plan_validation
from calibration.runs.plans import read_plan
from calibration.study.config import parse_config
from facts import tells
from stage_files import Files, PlanFiles
from workflow_rules import planned_jobs

ROOT = Path(__file__).parents[2]


@pytest.fixture
def clone(tmp_path):
    """A checkout without results: links to everything that the workflow reads."""
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


def snakemake(clone, *arguments):
    """What a call of snakemake prints."""
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "-j1", *arguments],
        cwd=clone,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.mark.slow
def test_a_dry_run_says_in_a_line_that_the_settings_have_changed(clone):
    snakemake(clone, "plan_tilt")
    shown = snakemake(clone, "-n", "plan_tilt", "--config", "seed=2")
    (line,) = (line for line in shown.splitlines() if line.startswith("plan the tilt test"))
    assert tells(line, "settings", "changed")
    assert not planned_jobs(clone, "plan_tilt", "--config", "validation={margin: 2}")
    assert not planned_jobs(clone, "plan_tilt")


@pytest.mark.parametrize(("source", "waits"), [("bench", True), ("config", False)])
def test_screening_waits_for_the_bench_tests_when_told_to(clone, source, waits):
    names = planned_jobs(clone, "screening", "--config", f"fixed_from={source}").keys()
    assert "plan_screening" in names
    assert {"tilt", "drop", "shear"}.issubset(names) == waits


def test_scaling_and_reproduction_are_targets(clone):
    names = planned_jobs(clone, "scaling", "reproduction").keys()
    assert {
        "plan_scaling",
        "scaling",
        "reproduction",
        "tilt",
        "drop",
        "shear",
        "screening",
    } <= names


def test_what_the_paper_claims_beyond_its_calibration_is_asked_for(clone):
    assert "reproduction" in planned_jobs(clone)
    assert "scaling" not in planned_jobs(clone)
    names = planned_jobs(clone, "--configfile", "config/config.yaml", "config/claims.yaml").keys()
    assert {"plan_scaling", "scaling", "reproduction"} <= names


def test_values_of_the_bench_tests_reach_the_planned_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    config = parse_config(yaml.safe_load((ROOT / "config" / "config.yaml").read_text()))
    found = tmp_path / "fixed.json"
    found.write_text(json.dumps({"fixed": {"salt_steel_static_friction": 0.6543}}))
    optimum = tmp_path / "optimum.json"
    optimum.write_text(json.dumps({"optimum": {"salt_salt_rolling_friction": 0.2}}))
    for files, friction in (([], 0.71), ([found], 0.6543)):
        study = study_of(config.model_dump(mode="json")).with_bench(files)
        plan_validation(study, Files(optimum=optimum), PlanFiles.of(tmp_path / "validation"))
        specs = read_plan(tmp_path / "validation" / "plan.json").values()
        assert {s["contacts"]["particle_wall"]["static_friction"] for s in specs} == {friction}
        assert {s["contacts"]["particle_wall"]["restitution"] for s in specs} == {0.421}
