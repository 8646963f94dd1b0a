"""Other engines on small scenes with the exported blocks: starting them, and reading what they
leave."""

import json
from pathlib import Path

from calibration.engines import lammps as to_lammps
from calibration.engines import liggghts as to_liggghts
from calibration.engines import yade as to_yade
from calibration.engines.conversion import Conversion, Granulate
from calibration.engines.program import find, run
from calibration.study.config import overlay, parse_config
from calibration.study.factors import read_factors
from calibration.telling.export.parameters import calibrated_spec
from dem.io.mapping import read_mapping
from dem.spec import parse_spec
from frozen import FROZEN
from other_codes import entry_or_skip

REFERENCE = FROZEN / "salt"
LONGEST_S = 600.0


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
    text = code.block(Granulate(parsed), Conversion(parsed, found), ["a test"])
    (Path(folder) / name).write_text(text)
    return name


def liggghts(folder, text):
    """Run LIGGGHTS on an input text."""
    entry_or_skip("liggghts")
    (folder / "in.liggghts").write_text(text)
    program = [*to_liggghts.launcher(), find("liggghts", to_liggghts.INSTALL)]
    return run([*program, "-in", "in.liggghts"], folder, LONGEST_S)


def lammps(folder, text):
    """Run LAMMPS on an input text."""
    entry_or_skip("lammps")
    (folder / "in.lammps").write_text(text)
    command = [find("lmp", to_lammps.INSTALL), "-in", "in.lammps"]
    return run(command, folder, LONGEST_S, to_lammps.environment())


def yade(folder, text):
    """Run YADE on a script."""
    entry_or_skip("yade")
    (folder / "in.py").write_text(text)
    return run([find("yade", to_yade.INSTALL), "-j1", "-n", "-x", "in.py"], folder, LONGEST_S)
