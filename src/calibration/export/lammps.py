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

import math

from calibration.export.header import header
from calibration.export.material import rolling_dashpot, rolling_stiffness

SPRING = (
    "The rolling spring is a constant in LAMMPS: that of a contact under {load:.3g} N, ten "
    "grain weights."
)


def hertz_stiffness(pair):
    """k of `hertz` [Pa]: 4/3 E*."""
    return 4.0 / 3.0 * pair.young


def tangential_stiffness(pair):
    """k_t of `mindlin` [Pa]: 8 G*."""
    return 8.0 * pair.shear


def tangential_damping(pair):
    """x_gamma,t: tangential over normal dashpot, 2 sqrt(G*/E*)."""
    return 2.0 * math.sqrt(pair.shear / pair.young)


def rolling(pair, rolling_friction, load, equivalent):
    """(k [N/m], gamma [N s/m]) of `sds` that equal the elastic-plastic law at a load [N]."""
    stiffness = rolling_stiffness(pair, rolling_friction, load, equivalent.stiffness_factor)
    dashpot = rolling_dashpot(pair, stiffness, equivalent.damping_ratio)
    return stiffness / pair.radius**2, dashpot / pair.radius**2


def block(material, conversion, about):
    """Text of the include file. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    g, e, gw = material, conversion.equivalent, material.grain_wall
    lines = header(
        "#",
        "LAMMPS, package GRANULAR: include this after `create_box`; atom_style sphere, units si, "
        "newton off, "
        "comm_modify vel yes. Move the grains with `fix move all ${integrator}`.",
        about,
        conversion,
        "rolling sds",
        *([SPRING.format(load=g.load)] if e.rotates else []),
    )
    lines += [
        _law("grain_grain", g.grain_grain, e.static_friction, e.rolling_friction, g, e),
        _law("grain_wall", gw, gw.static_friction, gw.rolling_friction, g, e),
        f"variable integrator string {'nve/sphere' if e.rotates else 'nve'}",
        "pair_style granular",
        "pair_coeff * * ${grain_grain}",
        f"timestep {g.time_step:.4g}",
        f"# grains: density {g.grain.density:g} kg/m3",
        "# a wall: fix floor all wall/gran granular ${grain_wall} zplane 0.0 NULL",
    ]
    return "\n".join(lines) + "\n"


def _law(name, pair, static_friction, rolling_friction, material, equivalent):
    k, gamma = rolling(pair, rolling_friction, material.load, equivalent)
    sds = f"rolling sds {k:.6g} {gamma:.6g} {rolling_friction:.6g} " if equivalent.rotates else ""
    twists = equivalent.rotates and material.spec.laws.torsion != "none"
    twisting = "twisting marshall " if twists else ""
    return (
        f'variable {name} string "hertz {hertz_stiffness(pair):.6g} {pair.restitution:.6g} '
        f"tangential mindlin_rescale/force {tangential_stiffness(pair):.6g} "
        f"{tangential_damping(pair):.6g} "
        f'{static_friction:.6g} {sds}{twisting}damping coeff_restitution"'
    )
