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

from collections.abc import Sequence

from calibration.engines.conversion import Conversion, Granulate
from calibration.engines.templates import macros

CODE = "mercurydpm"


def block(material: Granulate, conversion: Conversion, about: Sequence[str]) -> str:
    """Text of the C++ block. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    exports, pairs = conversion.exports(CODE), conversion.pairs(material)
    stated = exports | {"rolling": conversion.export("rolling", CODE)}  # 0 where it is held
    checked = "This block has been checked against the sources, not run."
    head = conversion.head(CODE, material, about, checked, mark="//")
    setters = [("grain", _numbers(stated, pairs[0])), ("grainWall", _numbers(stated, pairs[1]))]
    words = macros("calibration.telling.export", "mercurydpm")
    return words.block(head, material, setters, conversion.turns)


def _numbers(exports, pair):
    """{setter's end: values} of a pair of materials."""
    found = {key: x for export in exports.values() for key, x in export.numbers(pair).items()}
    found |= {"TorsionFrictionCoefficient": 0.0}
    return {key: x if isinstance(x, tuple) else (x,) for key, x in found.items()}
