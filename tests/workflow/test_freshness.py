"""What is made again: everything whose cause has changed, and nothing else, with snakemake's own
records and without them. `tests/unit/test_store.py` has the checks of single files."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from deployed import FACTORS

from calibration.intake.started_code import allow
from calibration.study.config.schema import Config
from dem.io.stl import write_stl
from facts import tells
from workflow_rules import dry_run

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
SOLVER = """import json, sys, yaml

spec = yaml.safe_load(open(sys.argv[1]))
bounce = spec["contacts"]["particle_wall"]["restitution"]
metrics = {"angle_of_repose_deg": 30 + 10 * bounce + 0.1 * (spec["seed"] % 3)}
json.dump(metrics, open("metrics.json", "w"))
"""
MEASURED = """experiment,quantity,value,unit
heap,angle_of_repose,35,deg
heap,angle_of_repose,36,deg
heap,angle_of_repose,37,deg
"""
TABLE = "run,A,B,C\n1,1,-1,-1\n2,-1,1,-1\n3,-1,-1,1\n4,1,1,1\n"
STUDY = """name: heaps
experiment: heap
factors: factors.tsv
measurements: measured.csv
target: {{ metric: angle_of_repose_deg, low: 0, high: 60 }}
engine: {{ name: command, command: "{python} {here}/solver.py {{spec}}", version: "1" }}
run:
  materials: {{ particle: {{ density_kg_m3: 2500, shear_modulus_Pa: 1.0e+7, poisson_ratio: 0.2 }} }}
  contacts:
    particle_particle: {{ restitution: 0.5, static_friction: 0.5, rolling_friction: 0.1 }}
  geometry: {{ plate_stl: plate.stl }}
  particles: {{ diameter_mm: 4.0 }}
screening: {{ design: table.csv, replicates: 2 }}
"""


def mesh(path, size):
    """A tetrahedron of some size [mm]."""
    corners = size * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    write_stl(path, corners, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]))


def allow_engine(folder):
    """Let the study of a folder start its program there."""
    allow(Config.model_validate(yaml.safe_load((folder / "study.yaml").read_text())), folder)


WANTED = ("--configfile", "study.yaml", "--", "screening")


def own_sources(folder):
    """The environment in which the folder's own sources are the ones that run."""
    return os.environ | {"PYTHONPATH": str(folder / "src")}


def snakemake(folder, *arguments):
    """What the workflow of the folder's own sources says; it must end well."""
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "-j2", *arguments, *WANTED], cwd=folder, text=True,
        env=own_sources(folder), check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    return done.stdout


def tree(folder):
    """{path: its time and content} of all in a folder but snakemake's own and compiled Python."""
    places = (folder / name for name in ("results", "study.yaml", "factors.tsv", "measured.csv"))
    found = {p for place in places for p in (place, *place.rglob("*"))}
    return {p: (p.lstat().st_mtime_ns, p.read_bytes() if p.is_file() else None) for p in found}


def planned(folder):
    """({rule: number}, what is said) of what a dry run would make; it changes nothing."""
    before = tree(folder)
    found = dry_run(folder, *WANTED, environment=own_sources(folder))
    assert tree(folder) == before
    return found


def jobs(folder):
    """{rule: number} of what a dry run would make."""
    return planned(folder)[0]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A screening that is finished, each of its runs a job of its own, beside sources of its
    own."""
    folder = tmp_path_factory.mktemp("finished")
    for name in ("Snakefile", "workflow", "config", "profiles", "src"):
        if (ROOT / name).is_file():
            shutil.copy2(ROOT / name, folder)
        else:
            unneeded = shutil.ignore_patterns("__pycache__", "*.egg-info")
            shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=unneeded)
    (folder / "data").symlink_to(ROOT / "data")
    (folder / "factors.tsv").write_text(FACTORS)
    (folder / "measured.csv").write_text(MEASURED)
    (folder / "table.csv").write_text(TABLE)
    (folder / "solver.py").write_text(SOLVER)
    (folder / "study.yaml").write_text(STUDY.format(python=sys.executable, here=folder))
    mesh(folder / "plate.stl", 100.0)
    allow_engine(folder)
    snakemake(folder)
    # a job of its own leaves the time that it took
    assert len(list((folder / "results/runs").glob("heap-*/benchmark.tsv"))) == 8
    return folder


@pytest.fixture
def study(finished, tmp_path):
    """A copy of it with the times of its files."""
    copy = Path(shutil.copytree(finished, tmp_path / "study", symlinks=True))
    allow_engine(copy)
    return copy


def first_run(study):
    return min((study / "results" / "runs").glob("heap-*/result.json"))


def edited(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def touched(study):
    """A fresh checkout: the files as they were, their times the present one."""
    now = time.time()
    for path in study.rglob("*"):
        if not {"results", ".snakemake"} & set(path.relative_to(study).parts):
            os.utime(path, (now, now))


def remarks(study):
    for name in ("src/dem/step.py", "src/calibration/chain/screening.py"):
        path = study / name
        path.write_text(f"# a remark\n{path.read_text()}\n# another\n")
    for name in ("workflow/scripts/task.py", "workflow/scripts/dem_run.py", "Snakefile"):
        with open(study / name, "a") as stream:
            stream.write("# a remark\n")


SAME = {
    "nothing": lambda study: None,
    "the times of a fresh checkout": touched,
    "comments and layout": remarks,
    "the order of keys": lambda s: edited(s / "study.yaml", "low: 0, high: 60", "high: 60, low: 0"),
}


@pytest.mark.parametrize("change", SAME.values(), ids=SAME)
def test_what_changes_no_number_makes_nothing_again(study, change):
    change(study)
    assert jobs(study) == {}


def test_copied_results_are_as_good_without_the_records(study):
    shutil.rmtree(study / ".snakemake")
    touched(study)
    assert jobs(study) == {}


RUN = {"dem_run": 1, "screening": 1}
PLAN = {"plan_screening": 1, "screening": 1}


def digit_of_a_metric(study):
    path = first_run(study)
    angle = json.loads(path.read_text())["metrics"]["angle_of_repose_deg"]
    edited(path, str(angle), str(angle + 1))


def truncated(path):
    path.write_bytes(path.read_bytes()[:-40])


def without_record(study, rule, file):
    """A table that was edited, and no record of the rule that left it."""
    (study / "results/heaps/.made_from" / f"{rule}.json").unlink()
    edited(study / "results/heaps" / file, "1", "2")


def no_text(study, file):
    (study / "results/heaps" / file).write_bytes(b"\xff\xfe\x81")


OTHER = {
    "a digit of a metric": (digit_of_a_metric, RUN),
    "a state that is gone": (lambda s: first_run(s).with_name("final.npz").unlink(), RUN),
    "a mesh halved in place": (lambda s: mesh(s / "plate.stl", 50.0), PLAN),
    "the table of the design": (
        lambda s: (s / "table.csv").write_text(TABLE.replace("4,1", "4,-1")),
        PLAN,
    ),
    "the design as it was planned": (
        lambda s: edited(s / "results/heaps/screening/design.csv", "-1", "1"),
        PLAN,
    ),
    "the factor table": (lambda s: edited(s / "factors.tsv", "0.6", "0.7"), PLAN),
    "the code of the analysis": (
        lambda s: edited(s / "src/calibration/statistics/anova.py", "\n\n\n", "\n\nNEW = 1\n\n"),
        PLAN,
    ),
    "a digit of a stage's table": (
        lambda s: edited(s / "results/heaps/screening/effects.csv", "1", "2"),
        {"screening": 1},
    ),
    "a table that was edited and the record that is gone": (
        lambda s: without_record(s, "screening", "screening/effects.csv"),
        {"screening": 1},
    ),
    "a plan that is gone": (
        lambda s: (s / "results/heaps/screening/plan.json").unlink(),
        PLAN,
    ),
    "a design that is gone": (
        lambda s: (s / "results/heaps/screening/design.csv").unlink(),
        PLAN,
    ),
    "a plan that is no text": (lambda s: no_text(s, "screening/plan.json"), PLAN),
    "the measured values": (lambda s: edited(s / "measured.csv", "36", "39"), {"screening": 1}),
    "a setting of the analysis": (
        lambda s: edited(s / "study.yaml", "high: 60", "high: 50"),
        {"screening": 1},
    ),
}


TOLD = {
    "a digit of a metric": "result.json",
    "a state that is gone": "final.npz",
    "a mesh halved in place": "plan.json",
    "the design as it was planned": "design.csv",
    "a digit of a stage's table": "effects.csv",
    "a plan that is gone": "plan.json",
    "a design that is gone": "design.csv",
    "a plan that is no text": "plan.json",
}
"""The file that a dry run names."""


@pytest.mark.parametrize("what", OTHER)
def test_what_changes_a_number_makes_again_what_follows_from_it(study, what):
    change, expected = OTHER[what]
    change(study)
    found, said = planned(study)
    assert found == expected
    assert f"/{TOLD.get(what, '')}" in said


def test_the_reason_is_that_the_digest_has_changed(study):
    OTHER["the measured values"][0](study)
    [line] = [x for x in snakemake(study, "-n").splitlines() if x.startswith("screening: ")]
    assert tells(line, "settings", "changed")


def test_so_does_it_in_copied_results_without_the_records(study):
    change, expected = OTHER["the measured values"]
    shutil.rmtree(study / ".snakemake")
    change(study)
    assert jobs(study) == expected


def test_after_it_was_made_again_nothing_is_left_to_be_made(study):
    tables = {p: p.read_text() for p in study.glob("results/heaps/screening/*.csv")}
    digit_of_a_metric(study)
    truncated(study / "results/heaps/screening/plan.json")
    snakemake(study)
    assert jobs(study) == {}
    assert {p: p.read_text() for p in tables} == tables


@pytest.mark.parametrize("question", ["--lint", "--rulegraph"])
def test_a_question_that_makes_nothing_changes_nothing(study, question):
    digit_of_a_metric(study)
    before = tree(study)
    assert first_run(study).name not in snakemake(study, question)
    assert tree(study) == before
