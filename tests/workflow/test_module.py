"""The workflow elsewhere: as a module of another one, in environments made for it, and from the
wheel in an empty folder."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile

import pandas as pd
import pytest
import yaml
from deployed import ROOT, copied, done, install_wheel, write_study

import calibration
from calibration.chain.jobs import study_of
from calibration.errors import ConfigError

SNAKEMAKE = [sys.executable, "-m", "snakemake"]
NO_PROFILE = ("--workflow-profile", "none")
OUTER = """
configfile: "outer.yaml"


module theirs:
    snakefile:
        "../copy/workflow/Snakefile"
    config:
        config["calibration"]
    prefix:
        "theirs"


use rule * from theirs as gc_*


module ours:
    snakefile:
        "../copy/workflow/Snakefile"
    config:
        config["calibration"] | {{"results": "kept/here"}}


use rule * from ours as own_*


rule mine:
    default_target: True
    input:
        rules.gc_{target}.{files},
        rules.own_{target}.{files},
"""


@pytest.fixture
def outer(tmp_path):
    """A folder for another workflow, with a study, beside a copy of the workflow alone."""
    shutil.copytree(ROOT / "workflow", tmp_path / "copy" / "workflow")
    study = write_study(tmp_path / "outer" / "bounce")
    config = {"calibration": yaml.safe_load(study.read_text())}
    (study.parents[1] / "outer.yaml").write_text(yaml.safe_dump(config))
    return study.parents[1]


@pytest.mark.slow
def test_a_module_with_a_prefix_and_one_without_do_not_meet(outer):
    """Both make the same screening, each where it was told to; their rules have other names."""
    (outer / "Snakefile").write_text(OUTER.format(target="report", files="output"))
    planned = done(*SNAKEMAKE, "-n", *NO_PROFILE, cwd=outer)
    for rule in ("gc_plan_screening", "own_plan_screening", "gc_report", "own_report"):
        assert re.search(rf"^{rule} +1$", planned, re.M)
    (outer / "Snakefile").write_text(OUTER.format(target="screening", files="output"))
    done(*SNAKEMAKE, "-j2", *NO_PROFILE, cwd=outer)
    for place in ("theirs/results", "kept/here"):
        found = json.loads((outer / place / "drops/screening/screening.json").read_text())
        assert found["factors"][0] == "bounce"
        assert len(list(outer.glob(f"{place}/runs/drop-*/result.json"))) == 8
    assert not (outer / "results").exists()


def test_a_job_makes_its_runs_with_the_study_s_engine(monkeypatch, tmp_path):
    """What a job is handed is the configuration as it was written; its plans name the engine."""
    study = write_study(tmp_path / "bounce")
    monkeypatch.chdir(tmp_path)
    opened = study_of(yaml.safe_load(study.read_text()))
    _, specs = opened.plan(pd.DataFrame({"bounce": [0.5]}))
    assert [spec["engine"]["name"] for spec in specs.values()] == ["command"]
    engine = {"name": "command", "command": "x", "version": "1", "files": ["gone.py"]}
    with pytest.raises(ConfigError, match=r"gone\.py"):
        study_of(yaml.safe_load(study.read_text()) | {"engine": engine})


def container():
    """{section: lines} of the container's recipe."""
    text = (ROOT / "workflow/envs/calibration.def").read_text()
    parts = re.split(r"^%(\w+)\n", text, flags=re.M)
    sections = {k: v.strip().splitlines() for k, v in zip(parts[1::2], parts[2::2], strict=True)}
    return {k: [line.strip() for line in v] for k, v in sections.items()}


@pytest.mark.slow
def test_the_container_s_recipe_installs_the_program(tmp_path):
    """Its files are copied and its commands run in an environment of this test, without the
    packages that a real one gets from an index."""
    recipe, copy = container(), copied(tmp_path / "copy")
    for line in recipe["files"]:
        source, target = line.split()
        target = tmp_path / "image" / target.lstrip("/")
        target.parent.mkdir(parents=True, exist_ok=True)
        done("cp", "-fLr", copy / source, target)
    done(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv")
    [site] = (tmp_path / "venv").glob("lib/python*/site-packages")
    site.joinpath("shared.pth").write_text("\n".join(p for p in sys.path if "site-packages" in p))
    alone = {"PIP_NO_INDEX": "1", "PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0"}
    path = f"{tmp_path / 'venv' / 'bin'}:{os.environ['PATH']}"
    assert "-r /opt/calibration/requirements.lock" in recipe["post"][0]
    for line in recipe["post"]:
        command = line.replace("/opt/", f"{tmp_path / 'image' / 'opt'}/")
        subprocess.run(["bash", "-c", command], check=True, env=os.environ | alone | {"PATH": path})
    program = tmp_path / "venv" / "bin" / "calibration"
    assert "run a study" in done(program, "--help")
    assert recipe["runscript"] == ['exec calibration "$@"']


METADATA = f"granular_calibration-{calibration.__version__}.dist-info"

pytestmark = pytest.mark.slow

NEW = (
    *("new", "peas", "--measured", "26.1", "28.4", "27.0", "--density", "1.35g/cm3"),
    *("--grain", "4mm", "--orifice", "25mm", "--plate", "10cm", "--height", "75mm", "--no-pilot"),
)


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    return install_wheel(tmp_path_factory.mktemp("installed"))


def test_the_packages_are_those_of_the_wheel(programs, tmp_path):
    code = "import calibration, dem, diagnosis; print(calibration.__file__, calibration.Study)"
    said = done(programs / "python", "-c", code, cwd=tmp_path)
    assert said.startswith(str(programs.parent))


def test_the_wheel_leaves_the_paper_in_the_clone(programs):
    [wheel] = programs.parents[1].glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    packages = {"dem", "calibration", "diagnosis", "snakemake_logger_plugin_calibration"}
    assert {n.split("/")[0] for n in names} == {*packages, METADATA}
    assert "calibration/workflow/Snakefile" in names
    rules = (ROOT / "workflow/rules").glob("*.smk")
    assert {f"calibration/workflow/rules/{file.name}" for file in rules} <= set(names)
    assert "calibration/workflow/paper.smk" not in names
    profiles = {n.split("/")[3] for n in names if n.startswith("calibration/workflow/profiles/")}
    assert profiles == {"default", "quick", "slurm", "test"}


def test_a_study_begins_and_is_planned_in_an_empty_folder(programs, tmp_path):
    done(programs / "dem", *NEW, cwd=tmp_path)
    spec = done(programs / "dem", "init", "--experiment", "heap", cwd=tmp_path)
    (tmp_path / "heap.yaml").write_text(spec)
    done(programs / "dem", "check", "heap.yaml", cwd=tmp_path)
    said = done(programs / "calibration", "run", "peas", "-n", cwd=tmp_path)
    assert "plan the screening" in said
    assert re.search(r"peas: 0 of \d+", said)
    assert not list((tmp_path / "results").rglob("result.json"))


def test_a_stage_is_made_in_an_empty_folder(programs, tmp_path):
    write_study(tmp_path / "bounce")
    done(programs / "calibration", "run", "bounce", "-j1", "screening", cwd=tmp_path)
    found = json.loads((tmp_path / "results/drops/screening/screening.json").read_text())
    assert found["factors"][0] == "bounce"  # the formula knows of no other
    made = list(tmp_path.glob("results/runs/drop-*/result.json"))
    assert len(made) == 8
    times = {p: p.stat().st_mtime_ns for p in (tmp_path / "results").rglob("*.json")}
    done(programs / "calibration", "run", "bounce", "-j1", "screening", cwd=tmp_path)
    assert {p: p.stat().st_mtime_ns for p in times} == times
