"""What a call of the workflow plans: the whole study, each stage that is asked for by name, further
materials and profiles; and the rules as they are written."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from snakemake.cli import parse_args

from calibration.chain.jobs import study_of
from calibration.runs.feasibility import check_ahead
from calibration.runs.plans import read_plan
from calibration.stages.validation import plan_validation
from calibration.study.config import parse_config, point_spec, read_target
from calibration.study.factors import read_factors
from calibration.study.stage import load_stages
from dem.run import run
from dem.spec import parse_spec
from diagnosis.declared import WAVES
from facts import tells
from stage_files import Files, PlanFiles
from workflow_rules import ROOT, dry_run, planned_jobs, read_workflow, rules_of

SNAKEMAKE = [sys.executable, "-m", "snakemake", "-j2"]
SOYBEAN = "examples/soybean/config.yaml"
BALL = "data/literature/table_tennis_ball.yaml"
SEARCH = {"plan_export_scan", "plan_export_confirmation", "plan_export_correction"}
SEARCH |= {"export_rolling", "export_converted"}
BENCH = {"tilt", "drop", "shear"}


@pytest.fixture
def clone(tmp_path):
    """A checkout without results: links to everything that the workflow reads."""
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


def snakemake(clone, *arguments):
    """(status, what is said) of a call."""
    done = subprocess.run(
        [*SNAKEMAKE, *arguments], cwd=clone, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def workflow():
    return read_workflow(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)


@pytest.fixture(scope="module")
def declared():
    return rules_of(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)


def test_the_whole_study_is_planned_without_what_is_asked_for_by_name(clone):
    jobs = planned_jobs(clone)
    assert jobs["plan_screening"] == jobs["export"] == jobs["report"] == 1
    assert "reproduction" in jobs
    assert not (SEARCH | {"scaling"}) & jobs.keys()


@pytest.mark.slow
def test_each_stage_is_a_target(clone):
    targets = "optimise validation scaling reproduction export_converted diagnose reference".split()
    jobs = planned_jobs(clone, *targets)
    wanted = {*targets, *SEARCH, *BENCH, "plan_scaling", "diagnosis_identify", "diagnosis_wave"}
    assert wanted <= jobs.keys()


@pytest.mark.slow
def test_a_second_material_is_planned_alone_and_coarsened_by_a_profile(clone):
    _, said = dry_run(clone, "--profile", "profiles/quick", "--configfile", SOYBEAN)
    assert "report: results/soybean-quick/report.html" in said
    assert "salt" not in said
    assert "audit" not in said


@pytest.mark.slow
def test_a_diagnosis_of_published_rebounds_is_planned(clone):
    _, said = dry_run(clone, "--configfile", BALL, "--", "diagnose")
    assert "results/table-tennis-ball/diagnosis/verdict.json" in said


@pytest.mark.slow
def test_screening_waits_for_the_bench_tests_when_told_to(clone):
    jobs = planned_jobs(clone, "screening", "--config", "fixed_from=bench")
    assert {"plan_screening"} | BENCH <= jobs.keys()


@pytest.mark.slow
def test_what_the_paper_claims_beyond_its_calibration_is_asked_for(clone):
    jobs = planned_jobs(clone, "--configfile", "config/config.yaml", "config/reference.yaml")
    assert {"plan_scaling", "scaling", "reproduction"} <= jobs.keys()


@pytest.mark.parametrize("profile", ["default", "quick", "test"])
def test_the_jobs_of_the_command_line_count_whatever_the_profile_says(profile, monkeypatch):
    monkeypatch.chdir(ROOT)
    for given, jobs in (["-j1"], 1), ([], 2):
        _, settings = parse_args([*given, "--profile", f"profiles/{profile}"])
        # snakemake takes the jobs for the cores where no cores are set
        assert (settings.jobs, settings.cores) == (jobs, None)


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


# --- the rules ---------------------------------------------------------------------------------


def test_what_takes_seconds_runs_where_snakemake_does(workflow):
    """All but what has a benchmark, and the runs: on a cluster each of these is a job."""
    jobs = {rule.name for rule in workflow.rules} - workflow._localrules - {"all", "study"}
    timed = {rule.name for rule in workflow.rules if rule.benchmark}
    assert jobs == timed | {"compile_engine", "run_batch", "reference", "comparison"}
    assert {"dem_run", "joint", "posterior", "heaps", "diagnosis_wave"} <= timed


def test_a_rule_names_the_tables_that_it_reads(workflow, declared):
    inputs = {rule.name: list(rule.input.keys()) for rule in workflow.rules}
    for name, rule in declared.items():
        for section in ("factors", "measurements"):
            assert (section in rule.reads) == (section in inputs[name]), (name, section)


def test_each_stage_ends_with_a_rule_and_its_plans_are_made(declared):
    stages = load_stages("calibration.stages", "diagnosis.declared", "paper.stages").values()
    assert {stage.rule for stage in stages} <= set(declared)
    made = {
        re.sub(r"\{wave.*?\}", str(wave), str(Path(rule.plan).parent))
        for rule in declared.values()
        for wave in range(1, WAVES + 1)
        if rule.plan
    }
    assert made == {f"results/salt/{plan.folder}" for stage in stages for plan in stage.plans}


# --- the diagnosis -----------------------------------------------------------------------------

HEAD = "experiment,quantity,value,unit,sd,n,drop_height_mm\n"
MINE = ("diagnose", "--config", "measurements=mine.csv")


@pytest.mark.slow
def test_a_table_of_single_contacts_trains_no_emulator(clone):
    """Each stage is a process that loads the project: those that would make nothing are left
    out."""
    rows = "".join(f"drop,rebound_height,{0.3 * h},mm,1,5,{h}\n" for h in (50, 100, 200))
    (clone / "mine.csv").write_text(HEAD + rows)
    stages = {rule for rule in planned_jobs(clone, *MINE) if rule.startswith("diagnos")}
    assert stages == {"diagnosis_identify", "diagnose"}


def test_every_fault_of_a_users_table_is_shown_before_any_run(clone):
    (clone / "mine.csv").write_text(
        f"{HEAD}drop,rebound_height,20,kg,1,5,150\ndrop,rebound_height,30,mm,,5,200\n"
    )
    code, said = snakemake(clone, *MINE)
    assert code != 0
    assert tells(said, "mine.csv", "line 2", "column unit", "kg", "mm")
    assert tells(said, "mine.csv", "line 3", "column sd")
    assert "Traceback" not in said
    assert not (clone / "results/runs").exists()


@pytest.mark.slow
def test_a_plan_says_which_measurement_a_diagnosis_lacks(clone):
    """Each test was made at one setting."""
    (clone / "mine.csv").write_text(
        f"{HEAD}drop,rebound_height,20,mm,1,5,150\ntilt,sliding_angle,30,deg,1,5,\n"
        "heap,angle_of_repose,40,deg,1,5,\n"
    )
    code, said = snakemake(clone, "-n", *MINE)
    assert code != 0
    assert tells(said, "mine.csv", "drop_height_mm")


# --- further materials -------------------------------------------------------------------------


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
    config = parse_config(yaml.safe_load(Path(path).read_text()), files=[path])
    check_ahead(config)
    assert list(read_target(config)) == measured
    told = [f.description for f in read_factors(config.factors)]
    assert sum(any(s in text for s in sources) for text in told) == published


@pytest.mark.slow
def test_published_values_give_the_published_angle_within_the_laboratories_spread(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(ROOT)
    config = parse_config(yaml.safe_load(Path(SOYBEAN).read_text()))
    levels = {f.key: config.fixed[f.name] for f in read_factors(config.factors)}
    spec = parse_spec(point_spec(config.own_run, config.experiment, levels, config.seed))
    angle = run(spec, tmp_path)["metrics"]["angle_of_repose_deg"]
    measured = read_target(config)
    # one run's own spread from flank to flank is about four degrees
    assert measured.min() - 2.0 < angle < measured.max() + 2.0


@pytest.mark.long
@pytest.mark.slow
def test_the_whole_study_runs(clone):
    code, said = snakemake(clone, "--configfile", SOYBEAN)
    assert code == 0, said
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
    assert not list((clone / "results" / "runs").glob("*/failed.yaml"))
