"""LIGGGHTS (3.8, public version): commands to include after `create_box 2 ...`, decks with walls of
meshes, and the program as the engine.

Its conventions, from the sources of version 3.8.0 (github.com/CFDEMproject/LIGGGHTS-PUBLIC, src/):

normal_model_hertz.h, global_properties.cpp
    E*, G* from Young's modulus and Poisson's ratio of each atom type, Hertz force and the dashpot
    of Tsuji et al. The tangential dashpot is alike, and the force may attract. This is the law
    `hertz` with `tsuji` here, with the same numbers.
tangential_model_history.h
    It keeps the displacement and multiplies it by the stiffness of the moment. Here the force is
    kept and reduced on unloading. There is nothing to convert. The difference shows in oblique
    impacts only.
rolling_model_epsd3.h
    k_r = rollingStiffness k_n (mu_r R*)^2 with k_n = (4/3) E* a the secant of the Hertz force,
    where `elastic_plastic` has the tangent 2 E* a: the factor is 3/2 of ours.
    Dashpot 2 eta sqrt(I k_r) with I = 1.4 m R^2 about the contact point, reduced for two grains,
    as here: eta is eta. Limit mu_r |F_n| R*; R* = R at a wall.
rolling_model_cdt.h
    Not used. The torque is mu_r k_n overlap R* times the part of the relative spin in the contact
    plane over the whole of it. Nothing stops it from turning a spin around within a step, so grains
    at rest shake.
cohesion_model_sjkr2.h
    F = k A with A = 2 pi overlap 2R* of two grains and 2 pi overlap R at a wall. `sjkr` has
    pi R* overlap for both, R* = R at a wall, so k is a fourth of ours, at a wall half. It does not
    change what friction is limited by, as here.
"""

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from calibration.engines import EngineError, rig
from calibration.engines.conversion import Conversion, Granulate
from calibration.engines.family import Code, pour_box
from calibration.engines.mesh import body, disc, frustum, write_mesh
from calibration.engines.program import engine_of, find, prime_seed, run, stated_version
from calibration.engines.templates import words
from dem.contact.rolling.elastic_plastic import SECANT
from dem.spec import RunSpec

CODE = "liggghts"
LEAST_STIFFNESS = 1.0 / SECANT
"""Factor of the rolling stiffness that is 1 in its words, the least that it takes."""
INSTALL = "Debian and Ubuntu have it: apt-get install liggghts"
MIN_YOUNG = 5.0e6
MAX_YOUNG = 1.0e9
"""Outside these LIGGGHTS asks for `soft_particles yes` or `hard_particles yes`."""
ORDER = ("normal", "tangential", "cohesion", "rolling")
"""Slots in the order of a `pair_style`."""


def block(material: Granulate, conversion: Conversion, about: Sequence[str]) -> str:
    """Text of the include file. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    exports, pairs = conversion.exports(CODE), conversion.pairs(material)
    young = material.grain.young_modulus, material.wall.young_modulus
    laws = [exports[slot].words for slot in ORDER if slot in exports]
    numbers = [
        (name, value, export.numbers(pairs[1])[name])
        for export in exports.values()
        for name, value in export.numbers(pairs[0]).items()
    ]
    return words(CODE).material(
        conversion.head(CODE, material, about), max(young) > MAX_YOUNG, min(young) < MIN_YOUNG,
        material, numbers, {name for export in exports.values() for name in export.alone},
        " ".join(filter(None, laws)), conversion.turns,
    )  # fmt: skip


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
    rig.refuse(spec, "LIGGGHTS", CODE)
    factor = spec.law_parameters.rolling_stiffness_factor  # type: ignore[attr-defined]  # a field for each law
    if factor is not None and factor < LEAST_STIFFNESS:
        raise EngineError(
            "LIGGGHTS has no rolling spring as soft as law_parameters.rolling_stiffness_factor "
            f"{factor:g}; allowed: at least {LEAST_STIFFNESS:.3g}"
        )


def start(spec: RunSpec, folder: Path, timeout_s: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Start the program on the deck of a `RunSpec` in `folder`; returns metrics and the last state.
    Raises EngineError."""
    command = [*launcher(), find("liggghts", INSTALL), "-in", "in.liggghts"]
    return OF_FAMILY.read(spec, folder, run(command, folder, timeout_s))


def _made(output):
    """Grains made, by the source's own count."""
    totals = re.findall(r"a total of (\d+) particle templates", output)
    return int(totals[-1]) if totals else 0


def _heap(spec, folder):
    pour = rig.Pour(spec)
    g = pour.rig
    write_mesh(folder / "plate.stl", disc(g.plate_radius))
    cone = (g.orifice_radius, g.orifice_height, g.mouth_radius, g.rim_height)
    write_mesh(folder / "funnel.stl", frustum(*cone) + frustum(*cone[2:], g.mouth_radius, pour.top))
    numbers = [*range(1000, 1000 + len(pour.radii)), 2000]
    seeds = [_other_seed(number, spec.seed) for number in numbers]
    every = max(round(2.2 * pour.largest / pour.speed / pour.dt), 1)
    text = words(CODE).heap(pour, seeds, every, prime_seed(spec.seed))
    return OF_FAMILY.head(spec, words(CODE).box(pour_box(pour)), min(pour.radii)) + text + pour.end


def _other_seed(number, seed):
    """LIGGGHTS refuses a deck of which two seeds are the same, and a run may have any."""
    own = prime_seed(number)
    return own if own != prime_seed(seed) else prime_seed(number + 2000)


def _walls(walls, folder, moves=None, lid=None):
    """Each body is a mesh."""
    names = [b["name"] for b in walls.bodies]
    for name in names:
        write_mesh(folder / f"{name}.stl", body(walls, name))
    return words(CODE).walls(names, lid)


OF_FAMILY = Code(CODE, block, "material.in", _walls, _heap, _made)
deck = OF_FAMILY.write
ENGINE = engine_of(CODE, OF_FAMILY.experiments, version, refuse, deck, start)
