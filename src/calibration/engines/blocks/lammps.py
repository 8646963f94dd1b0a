"""LAMMPS, package GRANULAR (22 July 2025): variables for `pair_coeff` and `fix wall/gran granular`.

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

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calibration.engines.blocks.header import header

if TYPE_CHECKING:
    from calibration.engines.blocks.conversion import Conversion
    from calibration.engines.blocks.material import Granulate


CODE = "lammps"
ORDER = ("normal", "tangential", "friction", "rolling", "torsion", "damping")
"""Slots in the order of a `pair_coeff`."""


def block(material: Granulate, conversion: Conversion, about: Sequence[str]) -> str:
    """Text of the include file. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    g, exports, pairs = material, conversion.exports(CODE), conversion.pairs(material)
    lines = header(
        "#",
        "LAMMPS, package GRANULAR: include this after `create_box`; atom_style sphere, units si, "
        "newton off, "
        "comm_modify vel yes. Move the grains with `fix move all ${integrator}`.",
        about,
        conversion,
        CODE,
        *[note for export in exports.values() for note in export.notes(pairs[0])],
    )
    lines += [
        _law("grain_grain", exports, pairs[0]),
        _law("grain_wall", exports, pairs[1]),
        f"variable integrator string {'nve/sphere' if conversion.equivalent.rotates else 'nve'}",
        "pair_style granular",
        "pair_coeff * * ${grain_grain}",
        f"timestep {g.time_step:.4g}",
        f"# grains: density {g.grain.density:g} kg/m3",
        "# a wall: fix floor all wall/gran granular ${grain_wall} zplane 0.0 NULL",
    ]
    return "\n".join(lines) + "\n"


def _law(name, exports, pair):
    parts = []
    for export in (exports[slot] for slot in ORDER if slot in exports):
        parts += [export.words, *(f"{x:.6g}" for x in export.numbers(pair).values())]
    return f'variable {name} string "{" ".join(filter(None, parts))}"'
