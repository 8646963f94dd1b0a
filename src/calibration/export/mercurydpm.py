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

import math

from calibration.export.header import header, no_torsion
from calibration.export.material import rolling_dashpot

TANGENTIAL = 2.0 / 3.0
SPRING = (
    "MercuryDPM takes the stiffness of the rolling spring from the shear modulus; it is stiffer "
    "than in the runs "
    "behind this number."
)


def shear_modulus(pair):
    """setEffectiveShearModulus [Pa]: G*/(2/3)."""
    return pair.shear / TANGENTIAL


def sliding_dissipation(pair):
    """setSlidingDissipation [-]: ours is dashpot sqrt(m* 8 G* a), theirs a number times sqrt(m* 8 G
    a)."""
    return pair.dashpot * math.sqrt(TANGENTIAL)


def rolling_friction(coefficient):
    """setRollingFrictionCoefficient for mu_r of `elastic_plastic`: the lever is 2 R* where ours is
    R*."""
    return 0.5 * coefficient


def rolling_stiffness(pair, load):
    """Rotational stiffness [N m] of the rolling spring under a load [N]: 8 G a (2 R*)^2."""
    lever = 2.0 * pair.radius
    return 8.0 * shear_modulus(pair) * pair.contact_radius(load) * lever**2


def rolling_dissipation(pair, load, ratio):
    """setRollingDissipation [N s/m] for a damping ratio of the rolling spring under a load [N]."""
    dashpot = rolling_dashpot(pair, rolling_stiffness(pair, load), ratio)
    return dashpot / (2.0 * pair.radius) ** 2


def block(material, conversion, about):
    """Text of the C++ block. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    g, e, gw = material, conversion.equivalent, material.grain_wall
    head = header(
        "//",
        "MercuryDPM 1.0: put this into setupInitialConditions(), with "
        "#include <Species/HertzianViscoelasticMindlinRollingTorsionSpecies.h>",
        about,
        conversion,
        "rolling of HertzianViscoelasticMindlinRollingTorsionSpecies",
        *([SPRING] if e.rotates else []),
        *no_torsion(g.spec),
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
        *_setters("grain", g.grain_grain, e.static_friction, e.rolling_friction, g.load, e),
        *_setters("grainWall", gw, gw.static_friction, gw.rolling_friction, g.load, e),
        *([] if e.rotates else ["setRotation(false);"]),
        f"setTimeStep({g.time_step:.4g});",
    ]
    return "\n".join(head + body) + "\n"


def _setters(name, pair, static_friction, rolling, load, equivalent):
    values = (
        ("EffectiveElasticModulusAndRestitutionCoefficient", pair.young, pair.restitution),
        ("EffectiveShearModulus", shear_modulus(pair)),
        ("SlidingDissipation", sliding_dissipation(pair)),
        ("SlidingFrictionCoefficient", static_friction),
        ("RollingFrictionCoefficient", rolling_friction(rolling) if equivalent.rotates else 0.0),
        ("RollingDissipation", rolling_dissipation(pair, load, equivalent.damping_ratio)),
        ("TorsionFrictionCoefficient", 0.0),
    )
    return [f"{name}->set{k}({', '.join(f'{x:.6g}' for x in v)});" for k, *v in values]
