"""A study in LIGGGHTS from its screening to its validation, with no run of this project's engine.

The height stands for the angle, which so few grains give to some degrees only. Cost: 28 heaps of
400 grains, less than three minutes of one core."""

import json

import pandas as pd
import pytest
import yaml
from deployed import done
from test_module import NO_PROFILE, ROOT, SNAKEMAKE

from calibration import engines
from calibration.runs.plans import read_plan
from other_codes import entry_or_skip
from small_heap import RUN

pytestmark = [pytest.mark.slow, pytest.mark.long, pytest.mark.peer]

FACTORS = """code\tname\tkey\tlow\thigh\tdescription
A\trolling\tcontacts.particle_particle.rolling_friction\t0.02\t0.4\tof grain and grain
B\tfriction\tcontacts.particle_particle.static_friction\t0.3\t0.8\tof grain and grain
C\trestitution\tcontacts.particle_particle.restitution\t0.3\t0.6\tof grain and grain
"""
MEASURED = "experiment,quantity,value,unit\n" + "heap,height,{},mm\n" * 3
HALF_A_GRAIN = RUN["particles"]["diameter_mm"] / 2
"""Difference of heights that does not matter [mm]."""
STUDY = {
    "name": "theirs",
    "engine": "liggghts",
    "factors": "factors.tsv",
    "measurements": "measured.csv",
    "tests": {"heap": {"experiment": "heap"}},
    "calibrate": {"to": "height_mm"},
    "run": RUN,
    "screening": {
        "kind": "plackett_burman", "runs": 4, "replicates": 2, "at_least": 2, "at_most": 2
    },
    "ascent": {"steps": 3},
    "response_surface": {"centre_runs": 3},
    "optimise": {"candidate_runs": 2},
    "validation": {"groups": 2, "replicates": 2, "margin": HALF_A_GRAIN},
    "runs_per_job": 8,
}  # fmt: skip
PLANS = {"screening": 8, "ascent": 3, "response_surface": 11, "candidate_first": 2, "validation": 4}


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The folder of the study's results after its validation."""
    entry_or_skip("liggghts")
    folder = tmp_path_factory.mktemp("study")
    (folder / "factors.tsv").write_text(FACTORS)
    (folder / "measured.csv").write_text(MEASURED.format(17, 18, 19))
    (folder / "study.yaml").write_text(yaml.safe_dump(STUDY))
    snakefile = ("--snakefile", ROOT / "workflow" / "Snakefile")
    command = [*SNAKEMAKE, *snakefile, "-j1", *NO_PROFILE, "--configfile", "study.yaml"]
    done(*command, "--", "validation", cwd=folder)
    return folder / "results" / "theirs"


def test_all_runs_are_the_other_code_s(study):
    """None of ours, and nothing of ours was compiled."""
    version = engines.entry_of("liggghts")["identity"]["version"]
    planned = {plan: read_plan(study / plan / "plan.json") for plan in PLANS}
    assert {plan: len(specs) for plan, specs in planned.items()} == PLANS
    runs = study.parent / "runs"
    results = [json.loads(p.read_text()) for p in runs.glob("heap-*/result.json")]
    assert {r["manifest"]["run"] for r in results} == {n for s in planned.values() for n in s}
    for result in results:
        assert result["engine"] == "other: liggghts"
        assert result["spec"]["engine"]["identity"]["version"] == version
    assert not list(runs.glob("*.compiled"))


def test_more_rolling_friction_makes_a_higher_heap(study):
    effects = pd.read_csv(study / "screening" / "effects.csv").set_index("name")["effect"]
    assert effects["rolling"] > 0.0


def test_the_optimum_gives_the_measured_height_in_that_code(study):
    """Some of the 95 % interval of the difference lies within the margin."""
    found = json.loads((study / "validation" / "validation.json").read_text())
    assert found["simulated_n"] == PLANS["validation"]
    assert found["difference_low"] < HALF_A_GRAIN
    assert found["difference_high"] > -HALF_A_GRAIN
