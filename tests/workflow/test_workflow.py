"""The workflow as a user meets it: dry runs, wrong configuration, and a run that fails or is
killed."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from dem.fingerprint import engine_fingerprint
from dem.results import write_result
from dem.spec import parse_spec
from dem.template import template

ROOT = Path(__file__).parents[2]
SNAKEMAKE = [sys.executable, "-m", "snakemake"]


def snakemake(*arguments, cwd=ROOT):
    return subprocess.run(
        [*SNAKEMAKE, *arguments], cwd=cwd, capture_output=True, text=True, check=False
    )


@pytest.fixture
def clone(tmp_path):
    """A checkout without results: links to everything that the workflow reads."""
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


@pytest.mark.parametrize("profile", ["default", "quick", "test"])
def test_a_dry_run_lists_the_first_stage(clone, profile):
    done = snakemake("-n", "-j2", "--profile", f"profiles/{profile}", cwd=clone)
    assert done.returncode == 0, done.stderr
    assert "plan the screening" in done.stdout + done.stderr


@pytest.mark.parametrize("target", ["optimise", "validation", "reference"])
def test_each_stage_is_a_target(clone, target):
    done = snakemake("-n", "-j2", target, cwd=clone)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_every_study_of_the_reference_is_one(clone):
    """Each is a list of files that are laid over the configuration; the last that names the study
    counts."""
    lists = re.findall(r"^ +\[(.+)\],$", (ROOT / "Snakefile").read_text(), re.M)
    studies = [re.findall(r'"(config/[\w/]+\.yaml)"', files) for files in lists]
    assert ["config/claims.yaml", "config/rigs/printed.yaml"] in studies
    for study in studies:
        files = "--configfile", "config/config.yaml", *study
        done = snakemake("-n", "-j2", *files, cwd=clone)
        assert done.returncode == 0, done.stderr
        names = [yaml.safe_load((ROOT / f).read_text()).get("name") for f in study]
        name = next((n for n in reversed(names) if n), "salt")
        assert f"results/{name}/" in done.stdout + done.stderr


def test_a_wrong_configuration_stops_before_any_run(clone):
    bad = clone / "bad.yaml"
    bad.write_text("screening: {alpha: 7}\n")
    done = snakemake("-j2", "--configfile", "config/config.yaml", "bad.yaml", cwd=clone)
    assert done.returncode != 0
    assert "screening.alpha" in done.stdout + done.stderr
    assert not (clone / "results" / "runs").exists()


def test_a_cut_off_result_is_missing_and_a_dry_run_says_so(clone, monkeypatch):
    """Even where snakemake looks at times alone and knows nothing of these files."""
    monkeypatch.chdir(clone)
    data = yaml.safe_load(Path("config/config.yaml").read_text())
    data["screening"]["foldover"] = False  # few enough runs for a job each
    Path("own.yaml").write_text(yaml.safe_dump(data))
    own = ("--configfile", "own.yaml", "--rerun-triggers", "mtime")
    planned = snakemake("-j1", *own, "--", "results/salt/screening/plan.json", cwd=clone)
    assert planned.returncode == 0, planned.stdout + planned.stderr
    specs = json.loads(Path("results/salt/screening/plan.json").read_text())
    Path("results/runs").mkdir(exist_ok=True)
    Path(f"results/runs/engine-{engine_fingerprint()}.compiled").touch()
    for name, spec in specs.items():
        folder = Path("results/runs") / name
        folder.mkdir()
        np.savez(folder / "final.npz", position=np.zeros((1, 3)))
        metrics = {"angle_of_repose_deg": 40.0}
        write_result(folder, parse_spec(spec), metrics, {"wall_time_s": 1.0})
    cut = list(specs)[4]
    path = Path("results/runs") / cut / "result.json"
    path.write_bytes(path.read_bytes()[:200])
    done = snakemake("-n", "-j2", "screening", *own, cwd=clone)
    shown = done.stdout + done.stderr
    assert done.returncode == 0, shown
    assert f"{cut}/result.json: is damaged" in shown
    assert "Traceback" not in shown
    assert [n for n in specs if f"DEM run {n}" in shown] == [cut], shown


def test_further_targets_have_files_of_their_own(clone):
    rows = (ROOT / "data/paper/measurements.csv").read_text()
    heights = "".join(f"heap,height,{h},mm,,,,,,\n" for h in (20, 22))
    (clone / "heights.csv").write_text(rows + heights)
    two = clone / "two.yaml"
    two.write_text(
        "measurements: heights.csv\n"
        "target: { low: 35, high: 55 }\n"
        "further_targets:\n"
        "  - { metric: height_mm, low: 10, high: 30, margin: 2 }\n"
        "  - { metric: spilled, goal: minimise, low: 0, high: 2000 }\n"
    )
    files = ("validation/height_mm.svg", "screening/pareto_spilled.svg")
    wanted = [f"results/salt/{name}" for name in files]
    done = snakemake("-n", "-j2", "--configfile", two, "--", *wanted, cwd=clone)
    assert done.returncode == 0, done.stderr
    assert "validation: replicates" in done.stdout + done.stderr


def spec(tmp_path, **changes):
    data = {
        "particles": {"count": 300, "diameter_mm": 4.0},
        "laws": {"rolling": "constant_torque"},  # so few grains make no heap under the default
        "geometry": {"generation_rate_per_s": 600},
        "output": {"checkpoint_interval_s": 0.05},
    }
    path = tmp_path / "spec.yaml"
    path.write_text(json.dumps(yaml.safe_load(template("heap")) | data | changes))
    return path


DEM = [sys.executable, "-m", "dem.cli"]


def test_a_run_that_cannot_be_measured_says_why(tmp_path):
    few = spec(tmp_path, particles={"count": 5, "diameter_mm": 4.0})
    done = subprocess.run(
        [*DEM, "run", few, "--out", tmp_path / "o"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "no heap" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "o" / "result.json").exists()
