"""LAMMPS (package GRANULAR) as the engine, with the exported material block and region walls."""

from __future__ import annotations

import math
import os
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.engines import EngineError, rig
from calibration.engines.blocks import lammps as block
from calibration.engines.lammps_family import Code
from calibration.engines.program import engine_of, find, prime_seed, run, stated_version
from calibration.engines.rigs import Dialect
from dem.walls.geometry import RECTANGLE, REVOLVED

if TYPE_CHECKING:
    from dem.spec import RunSpec


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


def environment() -> dict[str, str]:
    """The wheel's program finds its MPI library beside this Python; one thread a run."""
    library = str(Path(find("lmp", INSTALL)).parents[1] / "lib")
    before = os.environ.get("LD_LIBRARY_PATH")
    path = f"{library}{os.pathsep}{before}" if before else library
    return os.environ | {"LD_LIBRARY_PATH": path, "OMP_NUM_THREADS": "1"}


@cache
def version() -> str:
    """Version of the installed program. Raises EngineError."""
    return stated_version([find("lmp", INSTALL), "-h"], r"Simulator - (.+)", environment())


def refuse(spec: RunSpec) -> None:
    """Raise EngineError for what LAMMPS cannot represent of a `RunSpec`."""
    rig.refuse(spec, "LAMMPS", block.CODE)
    meshes = [key for key, value in spec.geometry if key.endswith("_stl") and value]
    if meshes:
        raise EngineError(
            f"LAMMPS has no meshes as walls: geometry.{meshes[0]} is not carried over"
        )


def start(spec: RunSpec, folder: Path, timeout_s: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Start the program on the deck of a `RunSpec` in `folder`; returns metrics and the last state.
    Raises EngineError."""
    command = [find("lmp", INSTALL), "-in", "in.lammps", "-log", "none"]
    return CODE.read(spec, folder, run(command, folder, timeout_s, environment()))


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


LID = """\
variable {name}_wanted equal {force:.9g}
variable {name}_force equal -({pushed})
variable {name}_net equal v_{name}_force-v_{name}_wanted
variable {name}_up equal f_{name}_path*f_{name}_count*dt
variable {name}_speed equal &
    f_{name}_impulse*(f_{name}_count+1)*dt/{mass:.9g}-{drag:.9g}*v_{name}_up
variable {name}_tick equal 2*step+1
variable {name}_twist atom {twists}
variable {name}_torque equal -c_{name}_torque
compute {name} all reduce sum {forces}
compute {name}_torque all reduce sum v_{name}_twist
fix {name}_impulse all ave/time 1 1 1 v_{name}_net ave running
fix {name}_path all ave/time 1 1 1 v_{name}_speed ave running
fix {name}_count all ave/time 1 1 1 v_{name}_tick ave running
"""
"""A lid of a mass under a load, with a drag: m v = integral of the force on it - m drag path.

A running mean times its number is a sum: so `fix ave/time` integrates force and speed. The mean of
2 step + 1 from the step 0 on is that number itself. It is one behind while the speed is found."""


def _walls(walls, folder, moves=None, lid=None):
    """Each element is a region with a wall. What turns needs the angle of its body."""
    moves = lid.name if lid else moves
    lines, count = [f"variable {moves}_up equal 0.0"] if moves else [], {}
    for body in walls.bodies if lid else ():
        lines.append(f"variable {body['name']}_turn equal 0.0")
    for kind, numbers, owner in walls.elements:
        count[owner] = count.get(owner, -1) + 1
        name, pressed = f"{owner}{count[owner]}", lid and owner == lid.name
        region, angle = _region(kind, numbers, lid.height if pressed else 0.0)
        move = f" move NULL NULL v_{owner}_up" if owner == moves else ""
        if lid:
            lines.append(f"variable {name}_turn equal v_{owner}_turn+{angle:.9g}")
            move += f" rotate v_{name}_turn 0 0 0 0 0 1"
        lines += [
            f"region {name} {region}{move}",
            f"fix {name} all wall/gran/region granular ${{grain_wall}} region {name}"
            + (" contacts" if pressed else ""),
        ]
    text = "\n".join(lines) + "\n"
    return text + _lid(lid, count[lid.name] + 1) if lid else text


def _lid(lid, parts):
    """Commands that let a lid of so many parts move. Columns of a wall's contacts: 2 to 4 the force
    on the grain, 5 to 7 the place."""
    fixes = [f"f_{lid.name}{k}" for k in range(parts)]
    return LID.format(
        name=lid.name,
        force=lid.force,
        mass=lid.mass,
        drag=lid.force / (lid.mass * lid.speed),
        forces=" ".join(f"{fix}[4]" for fix in fixes),
        pushed="+".join(f"c_{lid.name}[{k + 1}]" for k in range(parts)),
        twists="+".join(f"{fix}[5]*{fix}[3]-{fix}[6]*{fix}[2]" for fix in fixes),
    )


def _region(kind, numbers, height=0.0):
    """Words of a region, raised by `height` [m], and the angle about z by which it is turned."""
    if kind == RECTANGLE:
        return _upright(np.reshape(numbers[:9], (3, 3)), height)
    if kind != REVOLVED:
        raise EngineError("LAMMPS: a wall that is a mesh is not carried over")
    r0, z0, r1, z1 = np.add(numbers[:4], (0.0, height, 0.0, height))
    if z0 == z1 and r0 == 0.0:
        return f"cylinder z 0 0 {r1:.6g} {z0 - THICK:.6g} {z0:.6g} side out", 0.0
    if r0 == r1:
        return f"cylinder z 0 0 {r0:.6g} {z0:.6g} {z1:.6g} open 1 open 2", 0.0
    high = z1 if z1 > z0 else z0 + FLAT
    return f"cone z 0 0 {r0:.6g} {r1:.6g} {z0:.6g} {high:.6g} open 1 open 2", 0.0


def _upright(rectangle, height):
    """A block without thickness along x, which is then turned."""
    centre, along, up = rectangle
    if np.hypot(*up[:2]) or along[2]:
        raise EngineError("LAMMPS: a leaning rectangle as a wall is not carried over")
    turn = math.atan2(along[1], along[0])
    cos, sin = math.cos(turn), math.sin(turn)
    x = cos * centre[0] + sin * centre[1]
    y = round(cos * centre[1] - sin * centre[0], 12) + 0.0
    half, low, high = math.hypot(*along[:2]), centre[2] - abs(up[2]), centre[2] + abs(up[2])
    sides = x - half, x + half, y, y, low + height, high + height
    return f"block {' '.join(f'{side:.9g}' for side in sides)} side out", turn


TURN = """\
variable now equal step
variable begun equal ${{now}}
variable stays equal ${{{name}_turn}}
variable {name}_turn equal ${{stays}}+{rate:.9g}*dt*(step-${{begun}})"""
WATCH = """\
fix {label} all ave/time 1 {steps} {steps} v_{name}_force v_{name}_torque file {label}.txt"""
HOLD = "variable stays equal ${{{0}}}\nvariable {0} equal ${{stays}}"
LIFT = """\
variable now equal step
variable begun equal ${{now}}
variable {name}_up equal {speed:.9g}*dt*(step-${{begun}})"""
DIALECT = Dialect(
    _head,
    _walls,
    lift=lambda name, speed: LIFT.format(name=name, speed=speed),
    hold=lambda name: HOLD.format(f"{name}_up"),
    remove=lambda walls, name: f"unfix {name}0\n",
    load=lambda lid: f"variable {lid.name}_wanted equal ${{force}}",
    height=lambda lid: f"{lid.height:.9g}+v_{lid.name}_up",
    turn=lambda name, rate: TURN.format(name=name, rate=rate),
    stop=lambda name: HOLD.format(f"{name}_turn"),
    watch=lambda label, name, steps: WATCH.format(label=label, name=name, steps=steps),
)
CODE = Code(block, "material.lammps", "in.lammps", DIALECT, {"heap": _heap, "drop": _drop}, _made)
deck = CODE.write
ENGINE = engine_of("lammps", CODE.experiments, version, refuse, deck, start)
