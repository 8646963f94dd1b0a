"""The wheel is enough: installed into an environment of its own and used in an empty folder, far
from any clone."""

import json
import re
import zipfile

import pytest
from deployed import ROOT, done, install_wheel, write_study

import calibration

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
