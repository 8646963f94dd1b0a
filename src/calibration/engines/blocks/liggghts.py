"""LIGGGHTS (3.8, public version): commands to include after `create_box 2 ...`.

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

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calibration.engines.blocks.header import dispensed, header

if TYPE_CHECKING:
    from calibration.engines.blocks.conversion import Conversion
    from calibration.engines.blocks.material import Granulate


CODE = "liggghts"
MIN_YOUNG = 5.0e6
MAX_YOUNG = 1.0e9
"""Outside these LIGGGHTS asks for `soft_particles yes` or `hard_particles yes`."""
ORDER = ("normal", "tangential", "cohesion", "rolling")
"""Slots in the order of a `pair_style`."""


def block(material: Granulate, conversion: Conversion, about: Sequence[str]) -> str:
    """Text of the include file. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    g, exports, pairs = material, conversion.exports(CODE), conversion.pairs(material)
    young = [g.grain.young_modulus, g.wall.young_modulus]
    lines = header(
        "#",
        "LIGGGHTS 3.8: include this after `create_box 2 ...`; atom type 1 is the grain, 2 the "
        "wall. "
        "Move the grains with `fix move all ${integrator}`.",
        about,
        conversion,
        CODE,
        *dispensed(g.spec, CODE),
    )
    if max(young) > MAX_YOUNG:
        lines.append("hard_particles yes")
    if min(young) < MIN_YOUNG:
        lines.append("soft_particles yes")
    words = [exports[slot].words for slot in ORDER if slot in exports]
    lines += [
        _per_type("youngsModulus", young),
        _per_type("poissonsRatio", [g.grain.poisson_ratio, g.wall.poisson_ratio]),
        *[line for export in exports.values() for line in _numbers(export, *pairs)],
        f'variable law string "{" ".join(filter(None, words))}"',
        f"variable integrator string {'nve/sphere' if conversion.equivalent.rotates else 'nve'}",
        "pair_style gran ${law}",
        "pair_coeff * *",
        f"timestep {g.time_step:.4g}",
        f"# grains: density {g.grain.density:g} kg/m3; walls: type 2 and",
        "#   fix ... wall/gran ${law} mesh n_meshes ... meshes ...",
    ]
    return "\n".join(lines) + "\n"


def _numbers(export, grain_grain, grain_wall):
    """Lines of a law's numbers."""
    on_wall = export.numbers(grain_wall)
    for name, value in export.numbers(grain_grain).items():
        if name in export.alone:
            yield f"fix {name} all property/global {name} scalar {value:.6g}"
        else:
            yield _per_pair(name, value, on_wall[name])


def _per_type(name, values):
    numbers = " ".join(f"{v:.6g}" for v in values)
    return f"fix {name} all property/global {name} peratomtype {numbers}"


def _per_pair(name, grain_grain, grain_wall):
    """wall on wall never meets; the matrix must be symmetric and full"""
    numbers = f"{grain_grain:.6g} {grain_wall:.6g} {grain_wall:.6g} {grain_wall:.6g}"
    return f"fix {name} all property/global {name} peratomtypepair 2 {numbers}"
