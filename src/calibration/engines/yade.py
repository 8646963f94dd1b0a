"""YADE (2023.02a): materials and functors to execute in a script, a heap's script with walls of
facets, and the program as the engine.

Its conventions, from the class reference of the installed version and the source
pkg/dem/HertzMindlin.cpp (mirrored at github.com/bchareyre/yade-mpi). Newer formulas are those of
the installed version. A test reads the stiffnesses of live contacts and checks them:

Ip2_FrictMat_FrictMat_MindlinPhys
    E* and G* from Young's modulus and Poisson's ratio as here. en: the dashpot of Thornton et al.
    (2013), Eqs. B6 and B7, for a force that never attracts; `tsuji` here attracts at the end. Each
    returns its e, so e is carried over. en, es, frictAngle are tables by pair (MatchMaker,
    frictAngle in radians); krot and eta are single numbers.
Law2_ScGeom_MindlinPhys_Mindlin, includeMoment=True
    The moment grows by krot times the relative rotation, without a dashpot, up to
    eta (R1 + R2)/2 F_n. With R* = R/2 of equal grains, eta is half of mu_r of `elastic_plastic`.
    krot is a constant; there k_r grows with the load. While F_n is cut to zero at the end of an
    impact the moment has no limit.
Ig2_Facet_Sphere_ScGeom
    A facet counts as a sphere of twice the radius. R* is 2R/3 instead of R, so a grain on a facet
    is softer by sqrt(2/3), and the lever of eta is 3R/2. The limit of the moment is set there
    contact by contact (`wallRolling`). The softer contact stays, since the modulus is softened
    anyway.
"""

import re
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from calibration.engines import EngineError, rig
from calibration.engines.conversion import Conversion, Granulate
from calibration.engines.program import engine_of, find, read_dump, run, state_of, stated_version
from calibration.engines.templates import words
from dem.constants import GRAVITY
from dem.spec import RunSpec

CODE = "yade"
INSTALL = "Debian and Ubuntu have it: apt-get install yade"


def block(material: Granulate, conversion: Conversion, about: Sequence[str]) -> str:
    """Text of the script. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    exports, pairs = conversion.exports(CODE), conversion.pairs(material)
    head = conversion.head(CODE, material, about)
    numbers = [{slot: export.numbers(pair) for slot, export in exports.items()} for pair in pairs]
    return words(CODE).material(head, material, *numbers, conversion.turns)


@cache
def version() -> str:
    """Version of the installed program. Raises EngineError."""
    return stated_version([find("yade", INSTALL), "--version"], r"version:? *(\S+)").rstrip(",")


def deck(spec: RunSpec, folder: Path, material: str | None = None) -> None:
    """Write script and material block of a `RunSpec` of a heap into `folder`. material: text of the
    block, that of the spec unless given."""
    (folder / "material.py").write_text(material or rig.block_of(block, spec))
    pour = rig.Pour(spec)
    pitch = 2.2 * pour.largest
    every = max(round(pitch / pour.speed / pour.dt), 1)  # a layer has left the source by then
    radii, shares = ([float(x) for x in own] for own in (pour.radii, pour.shares))
    text = words(CODE).heap(pour, spec.seed, radii, shares, pitch, every, GRAVITY)
    (folder / "in.py").write_text(text)


def start(
    spec: RunSpec, folder: Path, timeout_s: float
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Start the program on the script of a `RunSpec` in `folder`; returns metrics and the last
    state. Raises EngineError. The state is as `program.state_of` gives it."""
    output = run([find("yade", INSTALL), "-j1", "-n", "-x", "in.py"], folder, timeout_s)
    made = re.search(r"^made (\d+)$", output, re.MULTILINE)
    if not made:
        raise EngineError(f"yade left no heap: {output.strip()[-300:] or 'no output'}")
    state = state_of(read_dump(folder / "end.dump"))
    return rig.heap_metrics(state, rig.Pour(spec), int(made.group(1))), state


refuse = partial(rig.refuse, name="YADE", code=CODE)
ENGINE = engine_of(CODE, ("heap",), version, refuse, deck, start)
