"""The rules as they are written: each says what it reads, and the picture of them is theirs."""

import re
from pathlib import Path

import pytest

from calibration.study.stages import load_stages
from diagnosis.declared import WAVES
from workflow_rules import ROOT, read_workflow, rules_of

DIRECTIVES = (
    "input", "output", "log", "benchmark", "wildcard_constraints", "resources", "params", "message",
    "script",
)  # fmt: skip
"""In the order of snakefmt, which holds them to it."""
NEEDED = {"output", "log", "message", "script"}
STAGES = load_stages("calibration.study.stages", "diagnosis.declared", "paper.stages").values()


@pytest.fixture(scope="module")
def workflow():
    return read_workflow(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)


@pytest.fixture(scope="module")
def declared():
    return rules_of(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)


def written():
    """{name: directives} of each rule as it stands in a file."""
    found = {}
    for file in (ROOT / "workflow").rglob("*.smk"):
        parts = re.split(r"^ *(?:rule|checkpoint) (\w+):\n", file.read_text(), flags=re.M)
        for name, text in zip(parts[1::2], parts[2::2], strict=True):
            found[name] = re.findall(r"^    (\w+):", text, re.M)
    return found


def test_each_rule_is_written_out():
    rules = written()
    assert len(rules) > 50
    for name, directives in rules.items():
        assert not NEEDED - set(directives), name
        assert set(directives) <= set(DIRECTIVES), name


def test_what_takes_seconds_runs_where_snakemake_does(workflow):
    """All but what has a benchmark, and the runs: on a cluster each of these is a job."""
    jobs = {rule.name for rule in workflow.rules} - workflow._localrules - {"all", "study"}
    timed = {rule.name for rule in workflow.rules if rule.benchmark}
    assert jobs == timed | {"compile_engine", "run_batch", "reference"}
    assert "plan_response_surface" not in jobs
    assert {"dem_run", "joint", "posterior", "heaps", "diagnosis_refine"} <= timed


def test_a_rule_names_the_tables_that_it_reads(workflow, declared):
    inputs = {rule.name: list(rule.input.keys()) for rule in workflow.rules}
    for name, rule in declared.items():
        for section in ("factors", "measurements"):
            assert (section in rule.reads) == (section in inputs[name]), (name, section)


def test_each_stage_ends_with_a_rule_and_its_plans_are_made(declared):
    assert {stage.rule for stage in STAGES} <= set(declared)
    folders = {plan.folder for stage in STAGES for plan in stage.plans}
    made = {
        re.sub(r"\{wave.*?\}", str(wave), str(Path(rule.plan).parent))
        for rule in declared.values()
        for wave in range(1, WAVES + 1)
        if rule.plan
    }
    assert made == {f"results/salt/{folder}" for folder in folders}
