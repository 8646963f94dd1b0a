"""Ranges of the factors: published ones where the table has the material, else what any dry grain
has."""

import difflib
from importlib.resources import files

from calibration.errors import CalibrationError
from calibration.intake.tables import table_of
from calibration.study.factors import Factor

WIDE = {
    "contacts.particle_wall.restitution": (0.2, 0.8),
    "contacts.particle_wall.static_friction": (0.2, 0.8),
    "contacts.particle_wall.rolling_friction": (0.02, 0.4),
    "contacts.particle_particle.restitution": (0.2, 0.8),
    "contacts.particle_particle.static_friction": (0.2, 0.8),
    "contacts.particle_particle.rolling_friction": (0.02, 0.4),
    "materials.particle.poisson_ratio": (0.2, 0.4),
}
"""Key of a run spec -> range that holds most dry grains: a choice of this project, no source."""
NAMES = (
    "grain_wall_restitution",
    "grain_wall_static_friction",
    "grain_wall_rolling_friction",
    "grain_grain_restitution",
    "grain_grain_static_friction",
    "grain_grain_rolling_friction",
    "grain_poisson_ratio",
)
BAND = 0.3  # of a single published value, to either side
UNPUBLISHED = "wide: holds most dry grains"


def materials() -> list[str]:
    """Names of the materials with published ranges."""
    return sorted({row["material"] for _, row in _published().rows})


def factors_of(material: str | None = None) -> list[Factor]:
    """Factors A to G with their ranges; the description names the source.

    Raises CalibrationError for a material that the table does not have; None takes wide ranges.
    """
    known = materials()
    written = {name.casefold(): name for name in known}
    material = material and written.get(material.casefold(), material)
    if material is not None and material not in known:
        near = difflib.get_close_matches(material, known, n=1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        raise CalibrationError(
            f"no values of {material!r}{hint}; allowed: {', '.join(known)}, or none"
        )
    table = _published()
    found = {
        row["key"]: (table, line, row) for line, row in table.rows if row["material"] == material
    }
    return [
        _factor(code, name, key, found.get(key))
        for code, name, key in zip("ABCDEFG", NAMES, WIDE, strict=True)
    ]


def _factor(code, name, key, known):
    if known is None:
        return Factor(code, name, key, *WIDE[key], UNPUBLISHED)
    table, line, row = known
    low, high = (table.number(line, c, row[c]) for c in ("low", "high"))
    if low == high:
        low, high = round((1 - BAND) * low, 4), round((1 + BAND) * high, 4)
    return Factor(code, name, key, low, high, row["source"])


def _published():
    return table_of(files("calibration.study.new").joinpath("published.csv").read_text("utf-8"))
