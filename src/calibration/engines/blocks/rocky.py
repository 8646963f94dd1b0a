"""Ansys Rocky: the calibrated model as tables to type in.

Its conventions, from its technical manual (ansyshelp.ansys.com, DEM technical manual 2024 R2, 2.1
and 2.3): the normal force `Hertzian spring-dashpot` and the tangential one `Mindlin-Deresiewicz`
are chosen for the whole project; restitution, static and dynamic friction belong to a pair of
materials. Rolling resistance is a number of the particle, not of the pair. Type A is mu_r F_n r
against the particle's own spin, with r the distance from its centre to the contact. Type C is a
spring and a limit without a dashpot, so it is not type C of here.
"""

from collections.abc import Mapping, Sequence

from calibration.engines.blocks.by_hand import (
    Expected,
    Row,
    contact_rows,
    material_rows,
    notes,
    page,
    shape,
    table,
)
from calibration.engines.blocks.conversion import Conversion
from calibration.engines.blocks.header import dispensed
from calibration.engines.blocks.material import Granulate
from calibration.engines.blocks.rig_by_hand import factory, geometries, simulation_time
from dem.contact.catalogue import LAWS

CODE = "rocky"
CALLED = {
    "restitution": "Restitution coefficient",
    "static_friction": "Static friction, and dynamic friction",
}
SLIP = (
    "Rocky's tangential law, Mindlin-Deresiewicz, softens before a contact slips, and the one "
    "calibrated with does not. Check the angle before you rely on it."
)


def block(
    material: Granulate,
    conversion: Conversion,
    about: Sequence[str],
    known: Mapping[str, Mapping] | None = None,
    expected: Expected | None = None,
) -> str:
    """Markdown. Arguments as `edem.block`."""
    known = known or {}
    spec = material.spec
    said = [*_rolling_notes(spec), *dispensed(spec, CODE), SLIP, *notes(known)]
    materials = [table(material_rows(material, wall), known) for wall in (False, True)]
    pairs = [table(_contact(material, wall), known) for wall in (False, True)]
    sections = [
        "## Physics: momentum",
        _physics(spec, conversion),
        "## Materials: the grains'",
        materials[0],
        "## Materials: the walls'",
        materials[1],
        "## Material interactions: grain and grain",
        pairs[0],
        "## Material interactions: grain and wall",
        pairs[1],
        "## Particles",
        table([_rolling(material)], known),
        *shape(spec),
        "## Geometries",
        *geometries(spec),
        "## Inlet",
        *factory(spec),
        "## Solver",
        table([Row("Time step of these runs", material.time_step, "s"),
               *simulation_time(spec)]),
    ]  # fmt: skip
    return page("Rocky", about, expected, said, sections)


def _physics(spec, conversion):
    law = conversion.export("rolling", CODE)
    rows = [
        Row("Normal force", "Hertzian spring-dashpot"),
        Row("Tangential force", "Mindlin-Deresiewicz"),
        Row("Rolling resistance model", law.called),
    ]
    return table(rows)


def _contact(material, wall):
    rows = contact_rows(material, wall)
    return [Row(CALLED[name], value, "", key) for name, value, key in rows if name in CALLED]


def _rolling(material):
    *_, (_, value, key) = contact_rows(material, wall=False)
    return Row("Rolling resistance", value, "", key)


def _rolling_notes(spec):
    out, law = [], LAWS["rolling"][spec.laws.rolling]
    walls = spec.contacts.particle_wall
    if CODE not in law.exports:
        out.append(
            f"NOT CONVERTED: rolling friction was calibrated as {law.name}. Rocky has no such law, "
            "and its heap differs with the same number."
        )
    if law.kernels:
        out.append(
            f"Rolling friction on walls is {walls.rolling_friction:.6g} in these runs. Rocky has "
            "one number for a particle, and the table has that of grain on grain. Where the two "
            "differ, that of the walls is NOT CONVERTED."
        )
    return out
