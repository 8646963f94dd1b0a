"""Other engines on small scenes with the exported blocks: starting them, and reading what they
leave."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from calibration.config import overlay, parse_config
from calibration.export.conversion import Conversion
from calibration.export.material import granulate
from calibration.export.rolling import calibrated_spec
from calibration.factors import read_factors
from dem.io.mapping import read_mapping
from dem.spec import parse_spec

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "results" / "reference" / "salt"
PLATE, ORIFICE, MOUTH, DISCHARGE, RIM = 0.040, 0.010, 0.040, 0.075, 0.12696
"""Radii and heights of the paper's rig [m]; the rim follows from the funnel's flank, 30 degrees
from the vertical."""


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


def write_rig(folder):
    """Write plate.stl and funnel.stl [m]: disc, and frustum with a collar of 70 mm above its
    rim."""
    turn = np.linspace(0.0, 2.0 * np.pi, 49)
    ring = {
        (r, z): np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(49, z)])
        for r, z in (
            (0.5 * PLATE, 0.0),
            (PLATE, 0.0),
            (ORIFICE, DISCHARGE),
            (MOUTH, RIM),
            (MOUTH, RIM + 0.07),
        )
    }
    inner, outer, orifice, rim, top = ring.values()
    centre = np.zeros(3)
    fan = [(centre, inner[i], inner[i + 1]) for i in range(48)]
    _write_stl(folder / "plate.stl", fan + _band(inner, outer))
    _write_stl(folder / "funnel.stl", _band(orifice, rim) + _band(rim, top))


def _band(a, b):
    return [t for i in range(48) for t in ((a[i], b[i], b[i + 1]), (a[i], b[i + 1], a[i + 1]))]


def _write_stl(path, triangles):
    lines = ["solid rig"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x:.9e} {y:.9e} {z:.9e}" for x, y, z in triangle]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid rig"]) + "\n")
