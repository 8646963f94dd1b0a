"""The project where nobody has a clone of it: its wheel in an environment of its own, and a study
that needs no engine."""

import os
import subprocess
import sys
import sysconfig

import yaml

from calibration.intake.started_code import allow
from calibration.study.config.schema import Config
from facts import ROOT

FACTORS = """code\tname\tkey\tlow\thigh\tdescription
A\tbounce\tcontacts.particle_wall.restitution\t0.4\t0.6\tof grain and plate
B\tfriction\tcontacts.particle_wall.static_friction\t0.3\t0.6\tof grain and plate
C\trolling\tcontacts.particle_wall.rolling_friction\t0.1\t0.3\tof grain and plate
"""
MEASURED = """experiment,quantity,value,unit,drop_height_mm
drop,rebound_height,1.2,mm,5.0
drop,rebound_height,1.3,mm,5.0
drop,rebound_height,1.1,mm,5.0
"""
SOLVER = """import json, sys, yaml

spec = yaml.safe_load(open(sys.argv[1]))
height = spec["geometry"]["drop_height_mm"]
bounce = spec["contacts"]["particle_wall"]["restitution"] ** 2
metrics = {"rebound_height_mm": height * bounce + 0.02 * (spec["seed"] % 2)}
json.dump(metrics, open("metrics.json", "w"))
"""
STUDY = """name: {name}
tests: {{ ball: {{ experiment: drop }} }}
factors: {folder}/factors.tsv
measurements: {folder}/measured.csv
calibrate: {{ to: rebound_height_mm }}
engine: {{ name: command, command: "{python} {folder}/solver.py {{spec}}", version: "1" }}
run:
  materials: {{ particle: {{ density_kg_m3: 2500, shear_modulus_Pa: 1.0e+7, poisson_ratio: 0.2 }} }}
  particles: {{ count: 1, diameter_mm: 2.0 }}
  geometry: {{ drop_height_mm: 5.0, drops: 2 }}
screening: {{ kind: plackett_burman, runs: 4, replicates: 2 }}
runs_per_job: 4
"""


READ = ("Snakefile", "workflow", "config", "profiles", "src", "data")
"""What the workflow reads of a checkout."""


def checkout(folder):
    """Link everything that the workflow reads into a folder; returns it, without results."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in READ:
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / name)
    return folder


def write_study(folder, name="drops", may_start=True):
    """A study of eight drops that a formula answers, for a workflow that runs in the folder above,
    where its program may start; returns its configuration file."""
    folder.mkdir(parents=True)
    (folder / "factors.tsv").write_text(FACTORS)
    (folder / "measured.csv").write_text(MEASURED)
    (folder / "solver.py").write_text(SOLVER)
    text = STUDY.format(name=name, folder=folder.name, python=sys.executable)
    (folder / "config.yaml").write_text(text)
    if may_start:
        allow(Config.model_validate(yaml.safe_load(text)), folder.parent)
    return folder / "config.yaml"


def copied(folder):
    """The tracked files, as a release has them; returns the folder."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    subprocess.run(
        ["tar", "-c", "--null", "--files-from=-", "-f", folder.parent / "copy.tar"],
        cwd=ROOT, input=listed.stdout, text=True, check=True,
    )  # fmt: skip
    folder.mkdir()
    subprocess.run(["tar", "-x", "-f", folder.parent / "copy.tar", "-C", folder], check=True)
    return folder


def install_wheel(folder):
    """Build the wheel from a copy and install it into a new environment in `folder`, whose other
    packages are those of this one; returns the environment's folder of programs."""
    source = copied(folder / "source")
    pip = [sys.executable, "-m", "pip", "--quiet"]
    alone = ["--no-index", "--no-deps", "--no-build-isolation"]
    done(*pip, "wheel", source, *alone, "--wheel-dir", folder)
    [wheel] = folder.glob("*.whl")
    venv = folder / "venv"
    done(sys.executable, "-m", "venv", "--without-pip", venv)
    done(*pip, f"--python={venv}", "install", "--no-index", "--no-deps", wheel)
    [site] = venv.glob("lib/python*/site-packages")
    others = [p for p in sys.path if p.endswith("site-packages")]
    (site / "shared.pth").write_text("\n".join([*others, sysconfig.get_path("purelib")]) + "\n")
    return venv / "bin"


def done(*command, cwd=None, env=os.environ, **options):
    """What a command said, both streams together; it must end well."""
    clean = {k: v for k, v in env.items() if k != "PYTHONPATH"}
    found = subprocess.run(
        list(map(str, command)), cwd=cwd, env=clean, text=True, check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options,
    )  # fmt: skip
    assert found.returncode == 0, found.stdout
    return found.stdout
