"""The diagnosis as a user meets it: targets, a faulty table, and a whole run whose second case
re-uses the first."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from diagnosis.verdict import validate
from facts import tells
from workflow_rules import planned_jobs

ROOT = Path(__file__).parents[2]
TARGETS = ["diagnosis_plan", "diagnosis_emulate", "diagnosis_calibrate", "diagnosis_identify"]


def snakemake(*arguments, cwd):
    return subprocess.run(
        [sys.executable, "-m", "snakemake", "-j2", *arguments],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def clone(tmp_path):
    """A checkout without results: links to everything that the workflow reads."""
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


def test_the_stages_of_the_diagnosis_are_targets(clone):
    done = snakemake("-n", *TARGETS, "diagnose", cwd=clone)
    assert done.returncode == 0, done.stderr
    for stage in ("base model", "name the cause", "extended model"):
        assert stage in done.stdout + done.stderr


def test_a_table_of_single_contacts_trains_no_emulator(clone):
    """Each stage is a process that loads the project: those that would make nothing are left
    out."""
    table = clone / "mine.csv"
    table.write_text(
        "experiment,quantity,value,unit,sd,n,drop_height_mm\n"
        + "".join(f"drop,rebound_height,{0.3 * h},mm,1,5,{h}\n" for h in (50, 100, 200))
    )
    jobs = planned_jobs(clone, "diagnose", "--config", "measurements=mine.csv")
    stages = {rule for rule in jobs if rule.startswith("diagnos")}
    assert stages == {"diagnosis_calibrate", "diagnosis_identify", "diagnose"}


def test_every_fault_of_a_users_table_is_shown_before_any_run(clone):
    table = clone / "mine.csv"
    table.write_text(
        "experiment,quantity,value,unit,sd,n,drop_height_mm\n"
        "drop,rebound_height,20,kg,1,5,150\n"
        "drop,rebound_height,30,mm,,5,200\n"
        "drop,rebound_height,40,mm,1,5,200\n"
    )
    done = snakemake("diagnosis_plan", "--config", "measurements=mine.csv", cwd=clone)
    shown = done.stdout + done.stderr
    assert done.returncode != 0
    assert tells(shown, "mine.csv", "line 2", "column unit", "kg", "mm")
    assert tells(shown, "mine.csv", "line 3", "column sd")
    assert "Traceback" not in shown
    assert not (clone / "results" / "salt" / "diagnosis" / "plan.json").exists()


def test_a_table_that_is_not_there_is_named(clone):
    done = snakemake("-n", "diagnose", "--config", "measurements=none.csv", cwd=clone)
    assert done.returncode != 0
    assert "none.csv" in done.stdout + done.stderr


@pytest.mark.parametrize("rows", [("drop", "tilt"), ("drop", "tilt", "heap")])
def test_a_plan_says_which_measurement_a_diagnosis_lacks(clone, rows):
    """Each test was made at one setting."""
    kinds = {"drop": "rebound_height,20,mm,1,5,150", "tilt": "sliding_angle,30,deg,1,5,",
             "heap": "angle_of_repose,40,deg,1,5,"}  # fmt: skip
    table = "".join(f"{kind},{kinds[kind]}\n" for kind in rows)
    head = "experiment,quantity,value,unit,sd,n,drop_height_mm"
    (clone / "mine.csv").write_text(f"{head}\n{table}")
    done = snakemake("-n", "diagnose", "--config", "measurements=mine.csv", cwd=clone)
    shown = done.stdout + done.stderr
    assert done.returncode != 0
    assert tells(shown, "mine.csv", "conditions" if len(rows) < 3 else "drop_height_mm")


@pytest.mark.long
@pytest.mark.slow
def test_the_shipped_case_runs_through_and_another_one_re_uses_its_runs(clone):
    test_profile = ("--profile", "profiles/test")
    done = snakemake(*test_profile, "diagnose", cwd=clone)
    assert done.returncode == 0, done.stdout + done.stderr
    folder = clone / "results" / "salt-test" / "diagnosis"
    verdict = json.loads((folder / "verdict.json").read_text())
    validate(verdict)
    assert len(verdict["residuals"]) == 7
    assert {r["experiment"] for r in verdict["residuals"]} == {"heap", "tilt", "drop", "shear"}
    for figure in ("residuals", "predictions", "ranking", "gain"):
        assert (folder / f"{figure}.svg").exists()

    trained = set(json.loads((folder / "plan.json").read_text()))
    # a heap that clogs the funnel has no result; the emulator does without it
    results = {name: clone / "results/runs" / name / "result.json" for name in trained}
    stamps = {name: path.stat().st_mtime_ns for name, path in results.items() if path.exists()}
    assert len(stamps) > 0.8 * len(trained)
    other = clone / "other.csv"
    lines = (ROOT / "data/paper/measurements.csv").read_text().splitlines()
    other.write_text("\n".join(lines[:-1]) + "\n")
    done = snakemake(
        *test_profile, "diagnose", "--config", "measurements=other.csv", "name=other", cwd=clone
    )
    assert done.returncode == 0, done.stdout + done.stderr
    again = clone / "results" / "other-test" / "diagnosis"
    assert set(json.loads((again / "plan.json").read_text())) == trained
    assert len(json.loads((again / "verdict.json").read_text())["residuals"]) == 6
    for name, stamp in stamps.items():
        assert (clone / "results/runs" / name / "result.json").stat().st_mtime_ns == stamp
