"""What is made again: everything whose cause has changed, and nothing else, with snakemake's own
records and without them: a task whose packages were edited, or that reads the section that was
changed. `tests/unit/test_store.py` has the checks of single files."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml
from deployed import FACTORS

from calibration import digests
from calibration.digests import digest
from calibration.intake.started_code import allow
from calibration.study.config import overlay, parse_config
from calibration.study.config.schema import VIEWS, Config
from workflow_rules import ROOT, dry_run, rules_of

GROUPS = {
    "EVERY": lambda name: True,
    "PLANS": lambda name: name.startswith("plan_"),
    "EXPORTS": lambda name: "export" in name,
    "DIAGNOSIS": lambda name: name.startswith("diagn"),
}
"""Rules by a word."""
SECTIONS = [
    # a key that is changed: the rules that run again
    ("screening", "alpha", 0.1, {"plan_screening", "screening", "export", "answer"}),
    ("ascent", "steps", 6, {"plan_ascent", "screening", "export", "answer"}),
    ("scaling", "margin_deg", 1.5, {"plan_scaling", "scaling", "export", "answer"}),
    ("posterior", "draws", 60, {"posterior", "plan_joint", "joint", "export", "answer"}),
    ("name", None, "other", {"export", "answer"}),
    ("runs_per_job", None, 3, {"export", "answer"}),
    (
        "seed", None, 5,
        {"PLANS", "EXPORTS", "tilt", "drop", "candidate", "optimise", "posterior", "joint",
         "answer"},
    ),
]  # fmt: skip


@pytest.fixture(scope="module")
def tasks():
    return rules_of(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)


def expanded(names, tasks):
    """Names of rules, those of groups among them."""
    groups = [GROUPS[name] for name in names if name in GROUPS]
    return {t for t in tasks if t in names or any(group(t) for group in groups)}


@pytest.fixture(scope="module")
def data():
    data = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    # a target, and a rig, which it names
    more = {"calibrate": {"to": "angle_of_repose_deg"}, "tests": {"pour": data["tests"]["heap"]}}
    return overlay(data, more)


@pytest.fixture(scope="module")
def config(data):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return parse_config(data)


def digests_of(tasks, config):
    """{rule: digest} as rules/common.smk makes it."""
    return {
        name: digest(config, task.reads, [task.function.split(":")[0]], [])
        for name, task in tasks.items()
    }


@pytest.fixture(scope="module")
def before(tasks, config):
    return digests_of(tasks, config)


PAPER = {"audit", "reproduction"}


@pytest.mark.parametrize(
    ("package", "stale"),
    [
        ("dem", {"EVERY"}),
        ("calibration", {"EVERY"}),
        ("diagnosis", {"DIAGNOSIS"} | PAPER),
        ("paper", PAPER),
    ],
)
def test_an_edited_package_makes_stale_what_is_in_it_and_above(
    package, stale, tasks, config, before, monkeypatch
):
    own = digests.package_digest
    monkeypatch.setattr(
        digests, "package_digest", lambda p: "edited" if p.name == package else own(p)
    )
    after = digests_of(tasks, config)
    assert {name for name in tasks if after[name] != before[name]} == expanded(stale, tasks)


def test_a_package_counts_by_its_modules_templates_and_tables(tmp_path):
    folder = tmp_path / "package"
    (folder / "deep").mkdir(parents=True)
    found = []

    def count():
        found.append(digests.package_digest.__wrapped__(folder))

    count()
    for name in ("a.py", "deep/b.j2", "deep/c.json", "deep/d.csv"):
        (folder / name).write_text("x")
        count()
    shutil.move(folder / "a.py", folder / "e.py")
    count()
    assert len(set(found)) == len(found)
    os.utime(folder / "e.py", (1.0, 1.0))
    (folder / "e.pyc").write_text("x")
    count()
    assert found[-1] == found[-2]


def test_another_version_of_a_library_makes_stages_stale(tasks, config, before, monkeypatch):
    own = digests._version
    monkeypatch.setattr(digests, "_version", lambda name: "0" if name == "scipy" else own(name))
    assert not set(digests_of(tasks, config).items()) & set(before.items())


@pytest.mark.parametrize(("section", "key", "value", "expected"), SECTIONS)
def test_a_changed_key_makes_stale_what_reads_its_section(
    section, key, value, expected, tasks, data, before
):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        changed = parse_config(overlay(data, {section: {key: value} if key else value}))
    after = digests_of(tasks, changed)
    assert {name for name in tasks if after[name] != before[name]} == expanded(expected, tasks)


def test_every_section_of_the_configuration_is_read_by_a_stage_or_stands_for_its_files(
    tasks, config
):
    read = {section for name, task in tasks.items() if name != "export" for section in task.reads}
    # where files are, which pages wait for which stage, and what only the written-out study has
    files = {"name", "results", "supplements", "fixed_from", "published", "engine", "resolution"}
    # how runs are shared among processes decides none of them
    files |= {"runs_per_job"}
    assert set(type(config).model_fields) == read - set(VIEWS) | files


# --- a finished study ----------------------------------------------------------------------

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
factors: factors.tsv
measurements: measured.csv
tests: {{ heap: {{ experiment: heap }} }}
engine: {{ name: command, command: "{python} {here}/solver.py {{spec}}", version: "1" }}
run:
  materials: {{ particle: {{ density_kg_m3: 2500, shear_modulus_Pa: 1.0e+7, poisson_ratio: 0.2 }} }}
  contacts:
    particle_particle: {{ restitution: 0.5, static_friction: 0.5, rolling_friction: 0.1 }}
  particles: {{ diameter_mm: 4.0 }}
screening: {{ design: table.csv, replicates: 2 }}
"""


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
    for name in ("src/dem/kernel/step.py", "src/calibration/engines/program.py"):
        path = study / name
        path.write_text(f"# a remark\n{path.read_text()}\n# another\n")
    for name in ("workflow/scripts/task.py", "workflow/scripts/dem_run.py", "Snakefile"):
        with open(study / name, "a") as stream:
            stream.write("# a remark\n")


def of_another_checkout(study):
    """The same results without snakemake's records, beside sources of other times."""
    touched(study)
    edited(
        study / "study.yaml", "design: table.csv, replicates: 2", "replicates: 2, design: table.csv"
    )
    shutil.rmtree(study / ".snakemake")


@pytest.mark.slow
@pytest.mark.parametrize("change", [lambda study: None, of_another_checkout], ids=["none", "all"])
def test_what_changes_no_number_makes_nothing_again(study, change):
    change(study)
    assert jobs(study) == {}


RUN = {"dem_run": 1, "screening": 1}
PLAN = {"plan_screening": 1, "screening": 1}


def digit_of_a_metric(study):
    path = first_run(study)
    angle = json.loads(path.read_text())["metrics"]["angle_of_repose_deg"]
    edited(path, str(angle), str(angle + 1))


def truncated(path):
    path.write_bytes(path.read_bytes()[:-40])


OTHER = {
    "a digit of a metric": (digit_of_a_metric, RUN),
    "the factor table": (lambda s: edited(s / "factors.tsv", "0.6", "0.7"), PLAN),
    # stages, by any byte of it, and no run: the engine, and what starts another, is as it was
    "the code, in remarks": (remarks, PLAN),
    "a digit of a stage's table": (
        lambda s: edited(s / "results/heaps/screening/effects.csv", "1", "2"),
        {"screening": 1},
    ),
    "the measured values": (lambda s: edited(s / "measured.csv", "36", "39"), {"screening": 1}),
}


TOLD = {"a digit of a metric": "result.json", "a digit of a stage's table": "effects.csv"}
"""The file that a dry run names."""


@pytest.mark.slow
@pytest.mark.parametrize("what", OTHER)
def test_what_changes_a_number_makes_again_what_follows_from_it(study, what):
    change, expected = OTHER[what]
    change(study)
    found, said = planned(study)
    assert found == expected
    assert f"/{TOLD.get(what, '')}" in said


@pytest.mark.slow
def test_after_it_was_made_again_nothing_is_left_to_be_made(study):
    tables = {p: p.read_text() for p in study.glob("results/heaps/screening/*.csv")}
    digit_of_a_metric(study)
    truncated(study / "results/heaps/screening/plan.json")
    snakemake(study)
    assert jobs(study) == {}
    assert {p: p.read_text() for p in tables} == tables


@pytest.mark.slow
@pytest.mark.parametrize("question", ["--lint", "--rulegraph"])
def test_a_question_that_makes_nothing_changes_nothing(study, question):
    digit_of_a_metric(study)
    before = tree(study)
    assert first_run(study).name not in snakemake(study, question)
    assert tree(study) == before
