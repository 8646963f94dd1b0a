"""The second material: its configuration is whole, its runs form heaps, the whole study runs."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from snakemake.cli import parse_args

from calibration.runs.feasibility import check_ahead
from calibration.study.config import parse_config, point_spec, read_target
from calibration.study.factors import read_factors
from dem.run import run
from dem.spec import parse_spec

ROOT = Path(__file__).parents[2]
SNAKEMAKE = [sys.executable, "-m", "snakemake"]
SOYBEAN = "examples/soybean/config.yaml"


@pytest.fixture
def clone(tmp_path):
    """A checkout without results."""
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


def test_a_dry_run_plans_the_second_material_alone(clone):
    command = [*SNAKEMAKE, "-n", "-j2", "--configfile", SOYBEAN]
    done = subprocess.run(command, cwd=clone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "report: results/soybean/report.html" in done.stdout
    assert "salt" not in done.stdout
    assert "audit" not in done.stdout


@pytest.mark.parametrize(
    ("name", "measured", "sources", "published"),
    [
        ("maize", [23.5, 21.86], ["Agriculture"], 3),
        ("quartz_sand", [32, 34, 36], ["Al-Hashemi", "Wensrich"], 3),
        ("pp", [29.82, 30.54], ["Sudsawat"], 5),
    ],
)
def test_a_study_begun_from_published_values_is_whole_and_names_their_sources(
    name, measured, sources, published, monkeypatch
):
    monkeypatch.chdir(ROOT)
    path = f"examples/{name}/config.yaml"
    config = parse_config(yaml.safe_load(Path(path).read_text()), file=path)
    check_ahead(config)
    assert list(read_target(config)) == measured
    told = [f.description for f in read_factors(config.factors)]
    assert sum(any(s in text for s in sources) for text in told) == published


@pytest.mark.parametrize(
    ("profile", "named", "name"),
    [("quick", ["--configfile", SOYBEAN], "soybean"), ("test", [], "salt")],
)
def test_a_profile_coarsens_whatever_study_is_named(clone, profile, named, name):
    command = [*SNAKEMAKE, "-n", "-j1", "--profile", f"profiles/{profile}", *named]
    done = subprocess.run(command, cwd=clone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert f"report: results/{name}-{profile}/report.html" in done.stdout


@pytest.mark.parametrize("profile", ["default", "quick", "test"])
def test_the_jobs_of_the_command_line_count_whatever_the_profile_says(profile, monkeypatch):
    monkeypatch.chdir(ROOT)
    for given, jobs in (["-j1"], 1), ([], 2):
        _, settings = parse_args([*given, "--profile", f"profiles/{profile}"])
        # snakemake takes the jobs for the cores where no cores are set
        assert (settings.jobs, settings.cores) == (jobs, None)


def test_published_values_give_the_published_angle_within_the_laboratories_spread(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(ROOT)
    config = parse_config(yaml.safe_load(Path(SOYBEAN).read_text()), file=SOYBEAN)
    levels = {f.key: config.fixed[f.name] for f in read_factors(config.factors)}
    spec = parse_spec(point_spec(config.run, config.experiment, levels, config.seed))
    angle = run(spec, tmp_path)["metrics"]["angle_of_repose_deg"]
    measured = read_target(config)
    # one run's own spread from flank to flank is about four degrees
    assert measured.min() - 2.0 < angle < measured.max() + 2.0


@pytest.mark.long
@pytest.mark.slow
def test_the_whole_study_runs(clone):
    command = [*SNAKEMAKE, "-j2", "--configfile", SOYBEAN]
    done = subprocess.run(command, cwd=clone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    study = clone / "results" / "soybean"
    screening = json.loads((study / "screening" / "screening.json").read_text())
    assert "bean_bean_rolling_friction" in screening["significant"]
    optimum = json.loads((study / "optimise" / "optimum.json").read_text())
    assert optimum["attainable"]
    validation = json.loads((study / "validation" / "validation.json").read_text())
    assert validation["simulated_n"] == 10
    # the mean of ten heaps against the surface's prediction, each with its standard error
    error = (validation["simulated_sd"] ** 2 / 10 + optimum["standard_error"] ** 2) ** 0.5
    assert abs(validation["simulated_mean"] - optimum["predicted"]) < 3.0 * error
    page = (study / "report.html").read_text()
    for key in ("screening", "validation", "exports"):
        assert f'<section id="{key}"' in page
    assert (study / "calibrated.yaml").is_file()
    assert not list((clone / "results" / "runs").glob("*/failed.yaml"))
