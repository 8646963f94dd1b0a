"""LIGGGHTS (3.8, public version) as the engine, with the exported material block and its own
walls."""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.engines import EngineError, rig
from calibration.engines.blocks import liggghts as block
from calibration.engines.lammps_family import Code
from calibration.engines.mesh import body, disc, frustum, write_mesh
from calibration.engines.program import engine_of, find, prime_seed, run, stated_version
from calibration.engines.rigs import Dialect
from dem.contact.rolling.elastic_plastic import SECANT

if TYPE_CHECKING:
    from dem.spec import RunSpec


LEAST_STIFFNESS = 1.0 / SECANT
"""Factor of the rolling stiffness that is 1 in its words, the least that it takes."""
INSTALL = "Debian and Ubuntu have it: apt-get install liggghts"

HEAD = """\
# {experiment} of LIGGGHTS 3.8; SI units; type 1: grains, 2: walls. Start: liggghts -in in.liggghts
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
{space}
neighbor {skin:.6g} bin
neigh_modify delay 0
include material.in
fix move all ${{integrator}}
fix pull all gravity {gravity} vector 0 0 -1
"""

BOX = """\
region box block {box} units box
create_box 2 box"""

HEAP = """\
fix plate all mesh/surface file plate.stl type 2
fix funnel all mesh/surface file funnel.stl type 2
fix rig all wall/gran ${{law}} mesh n_meshes 2 meshes plate funnel
{sizes}
region mouth cylinder z 0 0 {mouth:.6g} {low:.6g} {high:.6g} units box
fix source all insert/rate/region seed {seed} distributiontemplate sizes nparticles {count} &
    particlerate {rate:.6g} insert_every {every} overlapcheck yes all_in yes &
    vel constant 0 0 -{speed:.6g} region mouth ntry_mc 10000
compute kinetic all ke
thermo_style custom step atoms c_kinetic
"""

DROP = """\
fix floor all wall/gran ${{law}} primitive type 2 zplane 0.0
{grains}
set group all diameter {diameter:.9g} density {density:.9g}
thermo 100000
run {first}
dump trace all custom {every} trace.dump id z vz
dump_modify trace format "%d %.12g %.12g"
run {more}
"""


@cache
def version() -> str:
    """Version of the installed program, as it states it. Raises EngineError."""
    return stated_version([*launcher(), find("liggghts", INSTALL)], r"Version (\S+ [\d.]+)")


def launcher() -> list[str]:
    """LIGGGHTS loses the text of its errors unless the mpirun that it was built for starts it."""
    mpirun = Path(find("liggghts", INSTALL)).with_name("mpirun")
    return [str(mpirun), "--allow-run-as-root", "-np", "1"] if mpirun.exists() else []


def refuse(spec: RunSpec) -> None:
    """Raise EngineError for what LIGGGHTS cannot represent of a `RunSpec`."""
    rig.refuse(spec, "LIGGGHTS", block.CODE)
    factor = spec.law_parameters.rolling_stiffness_factor  # type: ignore[attr-defined]  # a field for each law
    if factor is not None and factor < LEAST_STIFFNESS:
        key, allowed = "law_parameters.rolling_stiffness_factor", f"at least {LEAST_STIFFNESS:.3g}"
        raise EngineError(
            f"LIGGGHTS has no rolling spring as soft as {key} {factor:g}; allowed: {allowed}",
            engine="LIGGGHTS", key=key, value=factor, allowed=allowed,
        )  # fmt: skip


def start(spec: RunSpec, folder: Path, timeout_s: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Start the program on the deck of a `RunSpec` in `folder`; returns metrics and the last state.
    Raises EngineError."""
    command = [*launcher(), find("liggghts", INSTALL), "-in", "in.liggghts"]
    return CODE.read(spec, folder, run(command, folder, timeout_s))


def _made(output):
    """Grains made, by the source's own count."""
    totals = re.findall(r"a total of (\d+) particle templates", output)
    return int(totals[-1]) if totals else 0


def _head(spec, space, radius):
    return HEAD.format(
        experiment=spec.experiment, space=space, skin=0.2 * radius, gravity=rig.GRAVITY
    )


def _heap(spec, folder):
    pour = rig.Pour.of(spec)
    r, g = pour.largest, pour.rig
    write_mesh(folder / "plate.stl", disc(g.plate_radius))
    cone = (g.orifice_radius, g.orifice_height, g.mouth_radius, g.rim_height)
    write_mesh(folder / "funnel.stl", frustum(*cone) + frustum(*cone[2:], g.mouth_radius, pour.top))
    side = 1.5 * max(g.plate_radius, g.mouth_radius)
    text = HEAP.format(
        sizes=_sizes(pour, spec.seed),
        mouth=g.mouth_radius - 0.2 * r,
        low=g.source_height - 1.1 * r,
        high=g.source_height + 1.1 * r,
        seed=prime_seed(spec.seed),
        count=pour.count,
        rate=pour.rate,
        every=max(round(2.2 * r / pour.speed / pour.dt), 1),
        speed=pour.speed,
    )
    box = f"{-side:.6g} {side:.6g} {-side:.6g} {side:.6g} {pour.bottom:.6g} {pour.top + r:.6g}"
    return _head(spec, BOX.format(box=box), min(pour.radii)) + text + pour.end


def _sizes(pour, seed):
    """Grains of each size and their shares. seed: of the run, which the source has."""
    lines, names = [], []
    for k, (radius, share) in enumerate(zip(pour.radii, pour.shares, strict=True)):
        lines.append(
            f"fix size{k} all particletemplate/sphere {_other_seed(1000 + k, seed)} atom_type 1 "
            f"density constant {pour.density:.6g} radius constant {radius:.9g}"
        )
        names.append(f"size{k} {share:.9g}")
    lines.append(
        f"fix sizes all particledistribution/discrete/numberbased {_other_seed(2000, seed)} "
        f"{len(names)} {' '.join(names)}"
    )
    return "\n".join(lines)


def _other_seed(number, seed):
    """LIGGGHTS refuses a deck of which two seeds are the same, and a run may have any."""
    own = prime_seed(number)
    return own if own != prime_seed(seed) else prime_seed(number + 2000)


def _drop(spec, folder):
    return rig.Drop.of(spec).deck(spec, _head, BOX, DROP, units=" units box")


LID = """\
fix {lid.name} all mesh/surface/stress/servo file {lid.name}.stl type 2 com 0 0 {lid.height:.9g} &
    ctrlPV force axis 0 0 1 target_val -{lid.force:.9g} vel_max {lid.speed:.9g} &
    kp {kp:.9g} ki {ki:.9g} kd 0"""
LOAD = """\
variable kp equal v_force*{kp:.9g}
variable ki equal v_force*{ki:.9g}
fix_modify {lid.name} servo/target_val -${{force}}
fix_modify {lid.name} servo/ctrlParam ${{kp}} ${{ki}} 0"""


def _gains(lid, force):
    """The servo multiplies by speed/force: so its speed goes with the mobility and the mass.

    A lid that presses down has a negative target along z: with a positive one along -z what the
    servo has added up changes its sign at the greatest speed (3.8.0, limit_vel)."""
    kp = force * lid.mobility / lid.speed
    return {"lid": lid, "kp": kp, "ki": force / (lid.mass * lid.speed)}


def _walls(walls, folder, moves=None, lid=None):
    """Each body is a mesh."""
    names = [b["name"] for b in walls.bodies]
    for name in names:
        write_mesh(folder / f"{name}.stl", body(walls, name))
    meshes = [
        LID.format(**_gains(lid, lid.force))
        if lid and name == lid.name
        else f"fix {name} all mesh/surface file {name}.stl type 2"
        for name in names
    ]
    return "\n".join([*meshes, _touch(names)]) + "\n"


def _touch(names):
    """LIGGGHTS takes one wall of meshes."""
    return f"fix rig all wall/gran ${{law}} mesh n_meshes {len(names)} meshes {' '.join(names)}"


def _remove(walls, name):
    """The other meshes become a wall anew: what it remembers of its contacts is lost."""
    others = [b["name"] for b in walls.bodies if b["name"] != name]
    return f"unfix rig\nunfix {name}\n{_touch(others)}\n"


DIALECT = Dialect(
    _head,
    _walls,
    lift=lambda name, speed: f"fix move_{name} all move/mesh mesh {name} linear 0 0 {speed:.9g}",
    hold="unfix move_{}".format,
    remove=_remove,
    load=lambda lid: LOAD.format(**_gains(lid, 1.0)),
    height=lambda lid: f"f_{lid.name}[9]",
    turn=lambda name, rate: (
        f"fix move_{name} all move/mesh mesh {name} rotate origin 0 0 0 axis 0 0 1 "
        f"period {2.0 * math.pi / rate:.9g}"
    ),
    stop="unfix move_{}".format,
    watch=lambda label, name, steps: (
        f"fix {label} all ave/time 1 {steps} {steps} f_{name}[3] f_{name}[6] file {label}.txt"
    ),
)
CODE = Code(block, "material.in", "in.liggghts", DIALECT, {"heap": _heap, "drop": _drop}, _made)
deck = CODE.write
ENGINE = engine_of("liggghts", CODE.experiments, version, refuse, deck, start)
