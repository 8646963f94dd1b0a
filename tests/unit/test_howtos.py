"""docs/extend.md word by word: its examples of a stage, a figure, a metric and an import are
applied to a copy of the project, and what was added does what the page says."""

import json
import math
import re
import shutil
import statistics
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from calibration.intake.measurements import read_measured
from howto_pages import ROOT, copy_with, own_python
from vtk_files import read_vtp


@pytest.fixture(scope="module")
def extended(tmp_path_factory):
    """A copy with the page's stage, figure and metric after `snakemake repeat` of the smallest
    study. The engine is compiled anew for each copy."""
    folder = tmp_path_factory.mktemp("extended")
    copy_with(folder, "stage", "figure", "metric")
    (folder / "config").unlink()
    shutil.copytree(ROOT / ".test" / "config", folder / "config")
    own_python(folder, "-m", "snakemake", "-j1", "repeat", "screening")
    return folder


# --- stage -------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_stage_added_as_the_page_says_runs(extended):
    made = extended / "results/drops/repeat"
    rows = (made / "runs.csv").read_text().splitlines()
    at = rows[0].split(",").index("response")
    values = [float(row.split(",")[at]) for row in rows[1:]]
    assert len(values) == 5
    found = json.loads((made / "repeat.json").read_text())
    assert found["mean"] == pytest.approx(statistics.fmean(values))
    assert found["sd"] == pytest.approx(statistics.stdev(values))
    assert (made / "spread_of_seeds.svg").read_text().startswith("<?xml")


@pytest.mark.slow
def test_the_page_of_the_study_and_a_second_start_know_it(extended):
    done = own_python(extended, "-c", "from calibration.study.stage import load_stages\n"
                  "stage = load_stages()['repeat']\n"
                  "from calibration.figures import response_of\n"
                  "words = stage.sentences({'sd': 1.5}, response_of('height_mm'))\n"
                  "print(stage.rule, *words)")  # fmt: skip
    assert done.stdout.startswith("repeat "), done.stderr
    assert "1.5 mm" in done.stdout
    again = own_python(extended, "-m", "snakemake", "-n", "repeat")
    assert not re.search(r"^repeat +\d", again.stdout + again.stderr, re.M)


# --- figure ------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_figure_added_as_the_page_says_is_drawn_and_shown(extended):
    made = extended / "results/drops/screening"
    # a point for each of the eight runs
    drawn = (made / "runs_in_order.svg").read_text()
    [points] = re.findall(r'<g id="PathCollection_1">.*?\n   </g>', drawn, re.S)
    assert points.count("<use ") == len((made / "runs.csv").read_text().splitlines()) - 1 == 8
    told = own_python(extended, "-c", "from calibration.study.stage import load_stages\n"
                  "print(*[f.name for f in load_stages()['screening'].figures])")  # fmt: skip
    assert told.stdout.split() == ["runs_in_order", "half_normal", "pareto"], told.stderr


# --- metric ------------------------------------------------------------------------------

RUN = """
from dem.experiments import experiments
from dem.run import run
from dem.spec import parse_spec

spec = parse_spec({
    "experiment": "tilt", "geometry": {"trials": 1, "tilt_rate_deg_s": 20},
    "contacts": {"particle_wall": {"static_friction": 0.5}},
    "particles": {"count": 4, "diameter_mm": 4.0},
})
print(run(spec, "out")["metrics"]["sliding_time_s"])
print("sliding_time_s" in experiments()["tilt"].targets)
"""


@pytest.mark.slow
def test_a_metric_added_as_the_page_says_is_measured(extended):
    done = own_python(extended, "-c", RUN)
    time, target = done.stdout.splitlines()
    # friction 0.5 holds up to its angle; a slide is seen a little later
    assert float(time) == pytest.approx(math.degrees(math.atan(0.5)) / 20, rel=0.05)
    assert target == "True"


# --- import ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def with_import(tmp_path_factory):
    folder = tmp_path_factory.mktemp("import")
    copy_with(folder, "import")
    return folder


DEM = "import sys; from calibration.interface.commands import main; sys.exit(main(sys.argv[1:]))"


@pytest.mark.slow
def test_a_format_added_as_the_page_says_is_read(with_import):
    log = with_import / "log.txt"
    log.write_text("start\nslides at 24.3 deg\nnext\nslides at 25.1 deg\n")
    done = own_python(with_import, "-c", DEM, "tilts", "log.txt", "--out", "tilts.csv")
    assert "2 angles, mean 24.7 deg" in done.stdout
    [measured] = read_measured(with_import / "tilts.csv").conditions
    assert (measured.experiment, measured.n) == ("tilt", 2)
    assert measured.value == pytest.approx(24.7)


# --- docs/geometry.md ----------------------------------------------------------------------------


def test_a_rig_in_python_is_filled_drawn_and_told(tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs" / "geometry.md").read_text("utf-8")
    (block,) = re.findall(r"## A rig of your own.*?```python\n(.*?)```", page, re.S)
    assert len([line for line in block.splitlines() if line]) <= 30
    monkeypatch.chdir(tmp_path)
    exec(block, there := {})
    sim = there["sim"]
    held = np.hypot(*sim.position[:, :2].T) < 0.05
    assert held.all()
    assert (sim.position[:, 2] > 0.9 * 0.002).all()
    fallen = 216 * 1350.0 * 4 / 3 * np.pi * 0.002**3 * 9.81 * 0.01  # J, from a centimetre
    assert sim.kinetic_energy() < 0.01 * fallen
    assert "##########" in capsys.readouterr().out
    assert read_vtp("peas.vtp")["Points"] == pytest.approx(sim.position)
    with Image.open("peas.png") as picture:
        assert picture.width == 800
    assert ElementTree.parse("dish.vtp").getroot().tag == "VTKFile"
