"""MercuryDPM (1.0): species for a driver code.

Its conventions, from the sources (mirrored at github.com/kuwt/MercuryDPM_fork, Kernel/):

HertzianViscoelasticNormalSpecies.cc, HertzianViscoelasticInteraction.cc
    F = (4/3) E* sqrt(R* overlap) overlap with the effective modulus E* itself (not Young's).
    The dissipation sqrt(5) |ln e|/sqrt(ln^2 e + pi^2) sqrt(m* F/overlap) equals the dashpot of
    Tsuji et al. as here: e is e.
MindlinInteraction.cc
    Tangential force (2/3) 8 G a times the displacement, a = sqrt(R* overlap): G is 3/2 of the
    effective G* here, where the stiffness is 8 G* a. slidingDissipation multiplies sqrt(m* 8 G a).
MindlinRollingTorsionInteraction.cc
    A force along v = 2 R* (omega_i - omega_j) x n with the lever 2 R*, limit mu F_n: mu is half of
    mu_r of `elastic_plastic`. Its spring is always 8 G a, which is stiffer than ours: by
    16 G/(E* f mu_r^2) in k_r, with our factor f. rollingDissipation is C_r/(2 R*)^2.
A wall has no curvature: R* = R there (BaseInteraction.cc).
setRotation(false) keeps grains from turning (DPMBase.h).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calibration.engines.blocks.header import dispensed, header

if TYPE_CHECKING:
    from calibration.engines.blocks.conversion import Conversion
    from calibration.engines.blocks.material import Granulate


CODE = "mercurydpm"


def block(material: Granulate, conversion: Conversion, about: Sequence[str]) -> str:
    """Text of the C++ block. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    g, exports, pairs = material, conversion.exports(CODE), conversion.pairs(material)
    stated = exports | {"rolling": conversion.export("rolling", CODE)}  # 0 where it is held
    head = header(
        "//",
        "MercuryDPM 1.0: put this into setupInitialConditions(), with "
        "#include <Species/HertzianViscoelasticMindlinRollingTorsionSpecies.h>",
        about,
        conversion,
        CODE,
        *[note for export in exports.values() for note in export.notes(pairs[0])],
        *dispensed(g.spec, CODE),
        "This block has been checked against the sources, not run.",
    )
    body = [
        "HertzianViscoelasticMindlinRollingTorsionSpecies species;",
        f"species.setDensity({g.grain.density:.6g});",
        "auto grain = speciesHandler.copyAndAddObject(species);",
        f"species.setDensity({g.wall.density:.6g});",
        "auto wall = speciesHandler.copyAndAddObject(species);",
        "auto grainWall = dynamic_cast<HertzianViscoelasticMindlinRollingTorsionMixedSpecies*>(",
        "    speciesHandler.getMixedObject(grain->getIndex(), wall->getIndex()));",
        *_setters("grain", stated, pairs[0]),
        *_setters("grainWall", stated, pairs[1]),
        *([] if conversion.equivalent.rotates else ["setRotation(false);"]),
        f"setTimeStep({g.time_step:.4g});",
    ]
    return "\n".join(head + body) + "\n"


def _setters(name, exports, pair):
    numbers = {}
    for export in exports.values():
        numbers |= export.numbers(pair)
    for key, values in (numbers | {"TorsionFrictionCoefficient": 0.0}).items():
        values = values if isinstance(values, tuple) else (values,)
        yield f"{name}->set{key}({', '.join(f'{x:.6g}' for x in values)});"
