"""Other engines on the same settled bed: LIGGGHTS, LAMMPS and YADE, where they are installed.

Each starts from this engine's settled state (contact history is lost), relaxes, and times ten
blocks of steps, in seconds of processor: other work on the machine counts little. The laws are
Hertz with history and rolling resistance as each engine offers it: LIGGGHTS `cdt`, LAMMPS `sds`,
YADE's rolling moment. LAMMPS' own style for Hertz contacts, which has no rolling, is faster than
its modular one, and is compared with this engine without rolling.
"""

import re
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np

from calibration.engines import EngineError, lammps, liggghts, yade
from calibration.engines.program import find, run
from calibration.engines.templates import macros
from dem.constants import GRAVITY
from dem.simulation import Simulation

RELAX, BLOCK = 6000, 3000
# YADE runs this many times fewer steps: it needs minutes for what the others do in seconds
FEWER = {"yade": 6}
LONGEST_S = 1e6
INPUTS = Path(__file__).with_name("inputs")
WORDS = macros("benchmarks.speed", "data")
TIMED = re.compile(r"(?:Loop time of|block seconds) (\S+)")
"""A wall time in the output of LIGGGHTS and LAMMPS, and of YADE's input."""


def run_peers(sim: Simulation, width: float, folder: Path) -> dict[str, np.ndarray]:
    """{engine: particle-steps per second of processor, of each of ten blocks} of the engines found,
    each on the grains of `sim` in a box `width` [m] wide."""
    write_states(sim, width, folder)
    out = {}
    for name, command in COMMANDS.items():
        relax, block = (steps // FEWER.get(name, 1) for steps in (RELAX, BLOCK))
        variables = {"width": f"{width:.9e}", "relax": str(relax), "block": str(block)}
        variables["gravity"] = str(GRAVITY)
        (folder / "bed.py").write_text(WORDS.yade(**variables))
        try:
            words = command(variables)
        except EngineError:  # it is not installed
            continue
        text, spent, wall = run_program(words, folder)
        # the last ten wall times that it tells, each times the share of a processor that it had
        seconds = spent / wall * np.array(TIMED.findall(text)[-10:], float)
        out[name] = sim.n * block / seconds
    return out


def write_states(sim: Simulation, width: float, folder: Path) -> None:
    """Write the grains in the form that each engine reads."""
    x, v, w, r = sim.position, sim.velocity, sim.spin, sim.radius
    box = (0.0, 0.0, -0.001), (width, width, float(x[:, 2].max()) + 0.02)
    grains = np.column_stack([np.ones(sim.n), r, np.full(sim.n, 1210.0), x, v, w])
    for engine, style in (("liggghts", "Atoms"), ("lammps", "Atoms # sphere")):
        write_data(folder / f"bed.{engine}.data", style, box, 1, grains)
    np.savetxt(folder / "bed.csv", np.column_stack([r, x, v, w]), "%.17g", ",")


def write_data(path: Path, style: str, box: Any, kinds: int, grains: np.ndarray) -> None:
    """Write grains as LIGGGHTS and LAMMPS read them: style is the heading of the atoms, box its low
    and its high corner [m], kinds the number of types. Columns of grains (n, 12): type from 1 on,
    radius [m], density [kg/m3], position [m], velocity [m/s] and spin [rad/s]."""
    edges = list(zip(*box, "xyz", strict=True))
    path.write_text(WORDS.data(style, edges, kinds, grains.tolist()))


def run_program(command: list[str], folder: Path) -> tuple[str, float, float]:
    """(output, processor time [s], wall time [s]) of a program that is run in a folder. Raises
    EngineError where it fails."""
    begin, before = time.perf_counter(), _children_time()
    text = run(command, folder, LONGEST_S)
    return text, _children_time() - before, time.perf_counter() - begin


def _children_time():
    """Processor time of all finished children [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _input(name, variables):
    """Words that name an input of LIGGGHTS or LAMMPS, with its variables."""
    flags = [p for k, v in variables.items() for p in ("-var", k, v)]
    return ["-in", str(INPUTS / name), *flags]


def _lammps(variables, style):
    return [find("lmp", lammps.INSTALL), *_input("bed.lammps.in", variables | {"style": style})]


WITHOUT_ROLLING = "gran/hertz/history"
COMMANDS = {
    "liggghts": lambda variables: [
        *liggghts.launcher(), find("liggghts", liggghts.INSTALL),
        *_input("bed.liggghts.in", variables),
    ],
    "lammps": lambda variables: _lammps(variables, "granular"),
    f"lammps {WITHOUT_ROLLING}": lambda variables: _lammps(variables, WITHOUT_ROLLING),
    "yade": lambda _: [find("yade", yade.INSTALL), "-j1", "-n", "-x", "bed.py"],
}  # fmt: skip
"""Engine -> its command, of the variables {name: text} of its input. Raises EngineError where it is
not installed."""
