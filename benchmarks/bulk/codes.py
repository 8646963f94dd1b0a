"""The cases in this engine, in LIGGGHTS, in LAMMPS and in YADE: each gives the heights of
the last grain over time, and the processor time that it took.

All have Hertz's normal force, Mindlin's tangential one with Coulomb's limit, a dashpot that gives
the prescribed restitution, and no resistance to rolling.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.bulk.cases import CONTACTS, LOOK, MATERIALS, Case
from benchmarks.speed.peers import run_program, write_data
from calibration.engines import lammps, liggghts, yade
from calibration.engines.program import find, read_frames
from calibration.engines.templates import macros
from dem.constants import GRAVITY
from dem.contact.registry import Laws, pair_properties
from dem.precompile import compile_engine
from dem.simulation import Simulation
from dem.walls.builder import WallSet

WORDS = macros("benchmarks.bulk", "inputs")
LAWS = Laws(rolling="none", torsion="none")
SKIN, WIDE, WIDE_SKIN = 0.1, 4.0, 0.5
"""Verlet distance of the others over the smallest radius; where the largest radius is more than
WIDE of it, WIDE_SKIN, the fastest of 0.1, 0.5, 1 and 2 for LIGGGHTS, which then searches wider for
all grains."""

MOVED = {
    f"dem-moved-{k}-{unit}": k * size
    for unit, size in (("nm", 1e-9), ("um", 1e-6), ("0.1mm", 1e-4))
    for k in (1, 2, 3, 4)
}
"""Name -> how far [m] the last material is from its place: what chance makes of a case."""

CRUSHED = 0.5
"""Share of its radius to which a grain may be pressed here before the run is stopped as blown up:
the sphere presses one against the floor by a fifth, and the others have no such limit."""


@dataclass(frozen=True)
class Outcome:
    """What a code made of a case.

    rows : the time_s and the height_m of the last grain at each look, from the start on
    present : number of grains at each look but the last
    processor_s, wall_s : time of the steps here; of the whole program elsewhere
    """

    rows: list[dict[str, float]]
    present: list[int]
    processor_s: float
    wall_s: float


def simulation(case: Case) -> Simulation:
    """The case at its start in this engine."""
    walls = WallSet().body("walls", material="steel", spin=(0.0, case.spin, 0.0))
    corners = case.triangles.reshape(-1, 3)
    walls.mesh(corners, np.arange(len(corners)).reshape(-1, 3))
    sim = Simulation(
        MATERIALS, CONTACTS, laws=LAWS, time_step=case.time_step, walls=walls,
        overlap_limit=CRUSHED,
    )  # fmt: skip
    for name in dict.fromkeys(map(str, case.material)):
        own = case.material == name
        sim.add_particles(
            case.position[own], case.radius[own], velocity=case.velocity[own], material=name
        )
    return sim


def run_here(case: Case, folder: Path, distance: float = 0.0) -> Outcome:
    """The case in this engine, with the grains of its last material so far along x [m]."""
    compile_engine()
    sim = simulation(case.moved(distance))
    rows, present = [_row(0.0, _last(sim))], []
    begin, spent = time.perf_counter(), time.process_time()
    for _ in range(case.looks):
        present.append(sim.n)
        sim.advance(LOOK)
        rows.append(_row(sim.time, _last(sim)))
    wall, spent = time.perf_counter() - begin, time.process_time() - spent
    return Outcome(rows, present, spent, wall)


def _last(sim):
    return sim.position[sim.tag.argmax(), 2]


def _row(time_s, height_m):
    return {"time_s": float(time_s), "height_m": float(height_m)}


def _finished(case, folder, command):
    """Outcome of a program that writes its looks to looks.dump."""
    _, spent, wall = run_program(command, folder)
    frames = read_frames(folder / "looks.dump")
    rows = [_row(k * LOOK * case.time_step, frame["z"][-1]) for k, frame in enumerate(frames)]
    return Outcome(rows, [len(frame["id"]) for frame in frames[:-1]], spent, wall)


def _write_data(case, folder, style):
    """Grains as LIGGGHTS and LAMMPS read them: types are numbered as `case.materials` are. There is
    room around the walls."""
    types = [1 + case.materials.index(name) for name in case.material]
    density = [MATERIALS[name].density for name in case.material]
    corners = case.triangles.reshape(-1, 3)
    box = corners.min(axis=0) - 0.01, corners.max(axis=0) + 0.01
    state = case.position, case.velocity, np.zeros_like(case.velocity)
    grains = np.column_stack([types, case.radius, density, *state])
    write_data(folder / "grains.data", style, box, len(case.materials), grains)


def _pair(a, b):
    return CONTACTS.get((a, b)) or CONTACTS[b, a]


def _numbers(case):
    """Return what the inputs of the others name beside materials and walls."""
    least, most = float(case.radius.min()), float(case.radius.max())
    return {
        "skin": (WIDE_SKIN if most > WIDE * least else SKIN) * least,
        "gravity": GRAVITY,
        "dt": case.time_step,
        "between": LOOK,
        "looks": case.looks,
    }


def run_liggghts(case: Case, folder: Path) -> Outcome:
    """The case in LIGGGHTS, in `folder`. Raises DemError."""
    _write_data(case, folder, "Atoms")
    (folder / "walls.stl").write_text(WORDS.stl(case.triangles.tolist()))
    turn_s = 2 * math.pi / abs(case.spin) if case.spin else math.inf
    text = WORDS.liggghts(case, _numbers(case), MATERIALS, _pair, turn_s)
    (folder / "in.liggghts").write_text(text)
    command = [*liggghts.launcher(), "liggghts", "-in", "in.liggghts"]
    return _finished(case, folder, command)


def _lammps_law(a, b):
    """Words of LAMMPS for a pair of materials. Its stiffness is given by numbers, as it makes the
    effective moduli of one material only; k_n = 4/3 E*, k_t = 8 G*, and the tangential dashpot is
    sqrt(S_t/S_n) of the normal one."""
    pair = _pair(a, b)
    p = pair_properties(LAWS, MATERIALS[a], MATERIALS[b], pair)
    dashpot = 2.0 * math.sqrt(p.shear / p.young)
    return (
        f"hertz {4 / 3 * p.young:.9g} {pair.restitution:g} tangential mindlin_rescale/force "
        f"{8 * p.shear:.9g} {dashpot:.6g} {pair.static_friction:g} damping coeff_restitution"
    )


def run_lammps(case: Case, folder: Path) -> Outcome:
    """The case in LAMMPS, in `folder`, with the surfaces that the triangles stand for. Raises
    DemError."""
    _write_data(case, folder, "Atoms # sphere")
    (folder / "in.lammps").write_text(WORDS.lammps(case, _numbers(case), _lammps_law))
    command = [find("lmp", lammps.INSTALL), "-in", "in.lammps", "-log", "none"]
    return _finished(case, folder, command)


def run_yade(case: Case, folder: Path) -> Outcome:
    """The case in YADE, in `folder`. Raises DemError."""
    names = case.materials
    codes = [names.index(name) for name in case.material]
    grains = np.column_stack([codes, case.radius, case.position, case.velocity])
    np.savetxt(folder / "grains.txt", grains, "%.12g")
    np.savetxt(folder / "walls.txt", case.triangles.reshape(-1, 9), "%.12g")
    text = WORDS.yade(case, _numbers(case), MATERIALS, _pair)
    (folder / "in.py").write_text(text)
    return _finished(case, folder, [find("yade", yade.INSTALL), "-j1", "-n", "-x", "in.py"])


CODES: dict[str, Callable[[Case, Path], Outcome]] = {
    "dem": run_here,
    **{name: partial(run_here, distance=distance) for name, distance in MOVED.items()},
    "liggghts": run_liggghts,
    "lammps": run_lammps,
    "yade": run_yade,
}
"""Name -> function of a case and a folder."""
