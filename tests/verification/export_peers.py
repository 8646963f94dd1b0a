"""Other engines on small scenes with the exported blocks: starting them, and reading what they
leave."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from calibration.engines.conversion import Conversion, granulate
from calibration.study.config import overlay, parse_config
from calibration.study.factors import read_factors
from calibration.telling.export.parameters import calibrated_spec
from dem.io.mapping import read_mapping
from dem.spec import parse_spec
from frozen import FROZEN

REFERENCE = FROZEN / "salt"


def program(name):
    """Path of an engine; skips the test where it is not installed."""
    beside = Path(sys.executable).parent / name
    found = str(beside) if beside.exists() else shutil.which(name)
    if not found:
        pytest.skip(f"{name} is not installed")
    return found


def reference_spec(**changes):
    """Run spec (a mapping) at the optimum that is kept as a reference, with `changes` laid over
    it."""
    config = parse_config(read_mapping("config/config.yaml")[0])
    optimum = json.loads((REFERENCE / "optimise" / "optimum.json").read_text())["optimum"]
    return overlay(calibrated_spec(config, read_factors(config.factors), optimum), changes)


def exported(code, spec, found, folder):
    """Write a code's block for a run spec (a mapping) and a conversion (content of rolling.json);
    returns its name."""
    parsed = parse_spec(spec)
    name = f"block.{code.__name__.rsplit('.', 1)[-1]}"
    text = code.block(granulate(parsed), Conversion(parsed, found), ["a test"])
    (Path(folder) / name).write_text(text)
    return name


def run(command, folder):
    """Run an engine in `folder`; its output goes into the failure."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    output = done.stdout + done.stderr
    assert done.returncode == 0, f"{command}:\n{output[-3000:]}"
    return output


def liggghts(folder, text):
    """Run LIGGGHTS on an input text."""
    path = program("liggghts")
    (folder / "in.liggghts").write_text(text)
    # started without mpirun it loses the text of its errors
    launch = ["mpirun", "--allow-run-as-root", "-np", "1"] if shutil.which("mpirun") else []
    return run([*launch, path, "-in", "in.liggghts"], folder)


def lammps(folder, text):
    """Run LAMMPS on an input text."""
    path = program("lmp")
    (folder / "in.lammps").write_text(text)
    return run([path, "-in", "in.lammps"], folder)


def yade(folder, text):
    """Run YADE on a script."""
    path = program("yade")
    (folder / "in.py").write_text(text)
    return run([path, "-j1", "-n", "-x", "in.py"], folder)


def read_dump(path):
    """{column: (n,)} of the last frame of a LIGGGHTS or LAMMPS dump, sorted by id."""
    lines = Path(path).read_text().split("ITEM: ATOMS")[-1].splitlines()
    names = lines[0].split()
    rows = np.array([line.split() for line in lines[1:]], float)
    rows = rows[np.argsort(rows[:, names.index("id")])]
    return dict(zip(names, rows.T, strict=True))
