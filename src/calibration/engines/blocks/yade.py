"""YADE (2023.02a): materials and functors to execute in a script.

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

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calibration.engines.blocks.header import dispensed, header

if TYPE_CHECKING:
    from calibration.engines.blocks.conversion import Conversion
    from calibration.engines.blocks.material import Granulate


CODE = "yade"
HOLD = """def holdGrains():
    for b in O.bodies:
        if b.mat.id == grain and b.state.blockedDOFs != "XYZ":
            b.state.blockedDOFs, b.state.angVel = "XYZ", (0, 0, 0)


upkeep = PyRunner(command="holdGrains()", iterPeriod=50, firstIterRun=1)"""


def _rolling(export, grain_grain, grain_wall):
    """Arguments of the physics and the engine that give grains their rolling moment."""
    grain, wall = export.numbers(grain_grain), export.numbers(grain_wall)
    moment = f"    krot={grain['krot']:.6g},\n    eta={grain['eta']:.6g},\n"
    upkeep = f"""def wallRolling():
    for i in O.interactions:
        if i.isReal and wall in (O.bodies[i.id1].mat.id, O.bodies[i.id2].mat.id):
            i.phys.maxBendPl = {wall["maxBendPl"]:.6g} * min(i.geom.refR1, i.geom.refR2)
            i.phys.kr = {wall["krot"]:.6g}


upkeep = PyRunner(command="wallRolling()", iterPeriod=50)"""
    return moment, upkeep


def _material(name, material, angle):
    return f"""{name} = O.materials.append(
    FrictMat(
        young={material.young_modulus:.6g},
        poisson={material.poisson_ratio:.6g},
        frictionAngle={angle:.6g},
        density={material.density:.6g},
        label="{name}",
    )
)"""


def block(material: Granulate, conversion: Conversion, about: Sequence[str]) -> str:
    """Text of the script. material: `Granulate`; conversion: `Conversion`; about: lines of
    provenance."""
    g, exports, pairs = material, conversion.exports(CODE), conversion.pairs(material)
    rotates = conversion.equivalent.rotates
    head = header(
        "#",
        "YADE 2023.02: execute this in a script, exec(open('yade.py').read()), and use grain, "
        "wall, physics, law and "
        "the engine upkeep.",
        about,
        conversion,
        CODE,
        *[note for export in exports.values() for note in export.notes(pairs[0])],
        *dispensed(g.spec, CODE),
    )
    (en, angles) = (
        [exports[slot].numbers(pair)[name] for pair in pairs]
        for slot, name in (("damping", "en"), ("friction", "frictAngle"))
    )
    moment, upkeep = _rolling(exports["rolling"], *pairs) if rotates else ("", HOLD)
    return (
        "\n".join(head)
        + f"""
{_material("grain", g.grain, angles[0])}
{_material("wall", g.wall, angles[1])}
physics = Ip2_FrictMat_FrictMat_MindlinPhys(
    en=MatchMaker(
        matches=((grain, grain, {en[0]:.6g}), (grain, wall, {en[1]:.6g}))
    ),
    frictAngle=MatchMaker(
        matches=((grain, grain, {angles[0]:.6g}), (grain, wall, {angles[1]:.6g}))
    ),
{moment})
law = Law2_ScGeom_MindlinPhys_Mindlin(includeMoment={rotates})


{upkeep}
O.dt = {g.time_step:.4g}
"""
    )
