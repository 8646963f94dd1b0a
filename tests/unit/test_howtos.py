"""docs/extend.md word by word: its examples of a stage, a figure, a metric and an import are
applied to a copy of the project, and what was added does what the page says; its experiment joins
from a folder, runs, is calibrated on and diagnosed; its mechanism finds what it claims to find."""

import json
import math
import os
import re
import shutil
import statistics
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from PIL import Image

from calibration.intake.measurements import read_measured
from dem.fingerprint import engine_fingerprint
from diagnosis.catalogue import Mechanism, load_catalogue
from facts import tells
from howto_pages import ROOT, copy_with, own_python
from started import python
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


EXAMPLE = ROOT / "examples" / "extend" / "experiment"
CODE, STUDY = ((EXAMPLE / name).read_text() for name in ("throw.py", "study.yaml"))
GRAVITY = 9.81


@pytest.fixture
def folder(tmp_path):
    """A folder with the example's file."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "throw.py").write_text(CODE)
    return tmp_path


def command(folder, script, status=0):
    """Python with the page's folder in the environment, as `started.python`."""
    env = os.environ | {"DEM_EXPERIMENTS": str(folder / "mine")}
    return python(folder, "-c", script, status=status, env=env)


@pytest.mark.slow
def test_the_pages_commands_run_it_to_its_closed_form(folder):
    done = command(
        folder,
        "from dem.cli import main\n"
        "assert main('init --experiment throw --out throw.yaml'.split()) == 0\n"
        "assert main('check throw.yaml'.split()) == 0\n"
        "assert main('run throw.yaml --out thrown'.split()) == 0\n"
        "text = open('throw.yaml').read().replace('length_mm: 200.0', 'length_mm: 2')\n"
        "open('short.yaml', 'w').write(text)\n"
        "assert main('check short.yaml'.split()) == 2\n",
    )
    assert tells(done.stderr, "geometry.plate_length_mm = 2.0", "4")
    result = json.loads((folder / "thrown" / "result.json").read_text())
    friction = result["spec"]["contacts"]["particle_wall"]["static_friction"]
    stop = 1e3 * 0.3**2 / (2.0 * friction * GRAVITY)
    assert result["metrics"]["stopping_distance_mm"] == pytest.approx(stop, rel=0.02)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("import no_such_module", "cannot be loaded"),
        (CODE.replace('name="throw"', 'name="tilt"'), "is taken"),
    ],
)
def test_a_file_that_declares_no_new_experiment_is_one_line(folder, text, says):
    (folder / "mine" / "throw.py").write_text(text)
    done = command(folder, "import sys; from dem.cli import main; sys.exit(main(['init']))", 2)
    [line] = done.stderr.strip().splitlines()
    assert line.startswith("dem: ")
    assert "throw.py" in line
    assert says in line


LAW_FILE = Path("src/dem/contact/friction/rate_free.py")
LAW = (ROOT / "examples/extend/law" / LAW_FILE).read_text()
CHOSEN = {"laws": {"friction": "rate_free"}, "law_parameters": {"friction_floor_N": 1e-7}}
"""The law of docs/extend.md; its floor is a thousandth of what holds a grain by its weight."""
FIXED = {"wall_friction": 0.5, "wall_restitution": 0.5, "wall_rolling": 0.2, "floor": 1e-8}


@pytest.mark.slow
def test_a_study_screens_and_diagnoses_it_and_a_made_up_law_without_another_file(folder):
    """The two examples' files and nothing else: a new experiment under a new law, in a temporary
    folder."""
    for name in ("Snakefile", "workflow", "config", "profiles", "data"):
        (folder / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "src", folder / "src", symlinks=True)
    (folder / LAW_FILE).write_text(LAW)
    study = yaml.safe_load(STUDY)
    study["run"] |= CHOSEN
    study["fixed"] = FIXED
    (folder / "study.yaml").write_text(yaml.safe_dump(study))
    row = "contacts.particle_wall"
    (folder / "factors.tsv").write_text(
        "code\tname\tkey\tlow\thigh\n"
        f"A\twall_friction\t{row}.static_friction\t0.3\t0.8\n"
        f"B\twall_restitution\t{row}.restitution\t0.3\t0.8\n"
        f"C\twall_rolling\t{row}.rolling_friction\t0.1\t0.4\n"
        "D\tfloor\tlaw_parameters.friction_floor_N\t1e-8\t1e-7\n"
    )
    speeds = np.array([0.12, 0.2, 0.3, 0.4, 0.55])
    stops = 1e3 * speeds**2 / (2.0 * 0.5 * GRAVITY)
    lines = [
        f"throw,stopping_distance,{s:.5g},mm,{0.03 * s:.3g},5,{v}"
        for v, s in zip(speeds, stops, strict=True)
    ]
    header = "experiment,quantity,value,unit,sd,n,launch_speed_m_s"
    (folder / "measured.csv").write_text("\n".join([header, *lines]) + "\n")
    words = "-m snakemake -j2 --configfile study.yaml -- screening diagnose".split()
    own = {"DEM_EXPERIMENTS": str(folder / "mine"), "PYTHONPATH": str(folder / "src")}
    python(folder, *words, env=os.environ | own)
    made = [json.loads(p.read_text()) for p in folder.glob("results/runs/throw-*/result.json")]
    assert {r["engine"] for r in made} != {engine_fingerprint()}
    assert {r["spec"]["laws"]["friction"] for r in made} == {"rate_free", "stress_dependent"}
    effects = json.loads((folder / "results/thrown/screening/screening.json").read_text())
    assert "wall_friction" in json.dumps(effects)
    verdict = json.loads((folder / "results/thrown/diagnosis/verdict.json").read_text())
    assert verdict["verdict"] == "adequate"
    assert verdict["calibration"]["wall_friction"]["value"] == pytest.approx(0.5, rel=0.05)


SHIPPED = (ROOT / "src/diagnosis/catalogue/uncounted_load.py").read_text()


@pytest.fixture
def own_load(tmp_path):
    """A folder with the file, its mechanism under another name than the catalogue's."""
    (tmp_path / "my_load.py").write_text(SHIPPED.replace('"uncounted_load"', '"my_load"'))
    return tmp_path


def test_a_file_in_a_folder_joins_the_catalogue(own_load):
    known = load_catalogue(folder=own_load)
    assert set(known) == set(load_catalogue()) | {"my_load"}
    assert isinstance(known["my_load"], Mechanism)


def test_a_tenth_of_a_kilopascal_gives_the_intercept_that_the_page_says(own_load):
    load = load_catalogue(folder=own_load)["my_load"]
    normal = np.array([1.0, 4.0, 8.0])
    read = [load.observe(0.845 * s, {"normal_stress_kPa": s}, 0.1) for s in normal]
    slope, intercept = np.polyfit(normal, read, 1)
    assert (slope, intercept) == pytest.approx((0.845, 0.0845))
