"""EDEM: the calibrated model in the order of EDEM's Creator, to type in.

Its conventions, from the user guide (help.altair.com/edem: Creator, Physics, Simulator):
Hertz-Mindlin (no slip) has the damping of Tsuji, Tanaka and Ishida (1992) and E*, G* of the pair.
Coefficients are given for each pair of materials, so there is no mixing rule. Rolling friction:
`standard` is mu_r F_n R_i against each body's own spin; `RVD` is mu_r F_n R* against the relative
spin; `type C` is a spring 2.25 k_n (mu_r R*)^2, a slider and a dashpot whose damping ratio refers
to the inertia about the contact point, as here. The time step is given in seconds, and as a share
of the Rayleigh time of the smallest grain.
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
from dem.constants import GRAVITY
from dem.grains import smallest_radius
from dem.timescales import rayleigh_time

CODE = "edem"
CALLED = {
    "restitution": "Coefficient of restitution",
    "static_friction": "Coefficient of static friction",
    "rolling_friction": "Coefficient of rolling friction",
}


def block(
    material: Granulate,
    conversion: Conversion,
    about: Sequence[str],
    known: Mapping[str, Mapping] | None = None,
    expected: Expected | None = None,
) -> str:
    """Markdown. about: lines of provenance; known: {key of the run spec: entry of calibrated.yaml}
    and what the calibrated model gives, or None at a point that no study has calibrated."""
    known = known or {}
    law = conversion.export("rolling", CODE)
    said = [*dispensed(material.spec, CODE), *law.notes(material.grain_grain), *notes(known)]
    sections = [
        _bulk_material(material, known),
        _equipment_material(material, known),
        "\n\n".join(["## 3. Geometries", *geometries(material.spec)]),
        "\n\n".join(["## 4. Geometries: particle factory", *factory(material.spec)]),
        _physics(material, law),
        f"## 6. Environment\n\nGravity: 0, 0, {-GRAVITY:.6g} m/s2.",
        _simulator(material),
    ]
    return page("EDEM", about, expected, said, sections)


def _bulk_material(material, known):
    rows = material_rows(material, wall=False)
    sizes = "\n".join(f"- {line}" for line in shape(material.spec))
    parts = ["## 1. Bulk material", table(rows, known), "Shape and size distribution:", sizes]
    parts += ["Interaction bulk : bulk:", table(_contact(material, wall=False), known)]
    return "\n\n".join(parts)


def _equipment_material(material, known):
    rows = material_rows(material, wall=True)
    interaction = table(_contact(material, wall=True), known)
    parts = ["## 2. Equipment material", table(rows, known)]
    return "\n\n".join([*parts, "Interaction bulk : equipment:", interaction])


def _contact(material, wall):
    return [Row(CALLED[n], value, "", key) for n, value, key in contact_rows(material, wall)]


def _physics(material, law):
    text = (
        f"Particle to particle and particle to geometry: {law.called}. It is the law calibrated "
        "with, and its numbers are used as they are."
    )
    rows = [Row(name, value) for name, value in law.numbers(material.grain_grain).items()]
    parts = ["## 5. Physics", text]
    return "\n\n".join([*parts, table(rows)] if rows else parts)


def _simulator(material):
    spec, grain = material.spec, material.grain
    rayleigh = rayleigh_time(
        smallest_radius(spec), grain.density, grain.shear_modulus, grain.poisson_ratio
    )
    rows = [
        Row("Fixed time step", material.time_step, "s"),
        Row("Share of the Rayleigh time", 100.0 * material.time_step / rayleigh, "%"),
        *simulation_time(spec),
    ]
    note = "Time integration: Velocity Verlet, of second order as in these runs."
    return "\n\n".join(["## 7. Simulator", table(rows), note])
