"""The experiment of docs/extend.md: its file joins from a folder, runs, is calibrated on and
diagnosed.

Each of the package's own experiments is named by one file.
"""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from dem.fingerprint import engine_fingerprint
from facts import tells
from started import python

ROOT = Path(__file__).parents[2]
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
