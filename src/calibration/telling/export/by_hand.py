"""Pages for programs that are filled in by hand: the calibrated model as tables to type in, each
value with its interval and where it came from, in the order of the program's own windows.

EDEM, from its user guide (help.altair.com/edem: Creator, Physics, Simulator): Hertz-Mindlin (no
slip) has the damping of Tsuji, Tanaka and Ishida (1992) and E*, G* of the pair. Coefficients are
given for each pair of materials, so there is no mixing rule. Rolling friction: `standard` is
mu_r F_n R_i against each body's own spin; `RVD` is mu_r F_n R* against the relative spin; `type C`
is a spring 2.25 k_n (mu_r R*)^2, a slider and a dashpot whose damping ratio refers to the inertia
about the contact point, as here. The time step is given in seconds, and as a share of the Rayleigh
time of the smallest grain.

Ansys Rocky, from its technical manual (ansyshelp.ansys.com, DEM technical manual 2024 R2, 2.1 and
2.3): the normal force `Hertzian spring-dashpot` and the tangential one `Mindlin-Deresiewicz` are
chosen for the whole project; restitution, static and dynamic friction belong to a pair of
materials. Rolling resistance is a number of the particle, not of the pair. Type A is mu_r F_n r
against the particle's own spin, with r the distance from its centre to the contact. Type C is a
spring and a limit without a dashpot, so it is not type C of here.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from calibration.engines.conversion import Conversion, Granulate, dispensed
from calibration.engines.templates import macros
from calibration.telling.export.parameters import leaves
from dem.constants import GRAVITY
from dem.contact.catalogue import LAWS
from dem.experiments.heap import Rig
from dem.grains.sizes import classes, longest_mm, rayleigh_of, spheres_in
from dem.schema import Part
from dem.units import in_ascii, unit_of, without_unit

OPEN = "NOT BOUNDED BY THE DATA"
INTERVALS = ("interval_95_others_held", "interval_95")
"""Intervals that an entry of calibrated.yaml may have; a table has the first that is given."""


def block(
    code: str,
    material: Granulate,
    conversion: Conversion,
    about: Sequence[str],
    known: Mapping[str, Mapping] | None = None,
    expected: Mapping[str, Any] | None = None,
) -> str:
    """Markdown for `edem` or `rocky`. about: lines of provenance; known: {key of the run spec:
    entry of calibrated.yaml}; expected: what the calibrated model gives in the runs that validated
    it (metric, unit, mean, sd, runs, and low and high, between which 95 % of single heaps lie), or
    None at a point that no study has calibrated."""
    spec, known = material.spec, known or {}
    words = macros("calibration.telling.export", "by_hand")
    given = {key for entry in known.values() for key in entry}
    kind = next((key for key in INTERVALS if key in given), INTERVALS[0])
    law, own_law = conversion.export("rolling", code), LAWS["rolling"][spec.laws.rolling]  # type: ignore[attr-defined]  # a field for each law
    sizes, clump = spec.particles.sizes, spec.particles.clump
    point = {
        "spec": spec, "material": material, "about": about, "expected": expected,
        "metric": without_unit(expected["metric"]).replace("_", " ") if expected else "",
        "law": law, "law_notes": list(law.notes(material.grain_grain)),
        "law_numbers": [(k, v, "") for k, v in law.numbers(material.grain_grain).items()],
        "own_law": own_law, "has_law": code in own_law.exports,
        "dispensed": dispensed(spec, code), "gravity": GRAVITY,
        "open": OPEN, "unbounded": any("not_bounded_by_the_data" in e for e in known.values()),
        "modulus": {"paper": ""} | dict(m) if (m := known.get(SHEAR_MODULUS)) else None,
        "table": lambda rows: words.typed(rows, known, kind, OPEN),
        "plain": lambda rows: words.typed(rows, {}, kind, OPEN),
        "rig": Rig(spec.geometry) if spec.experiment == "heap" else None,
        "parts": list(_keys(spec.geometry)),
        "spheres": spheres_in(clump) if clump else (), "longest": longest_mm(spec),
        "classes": _classes(spec.particles) if sizes else (),
        "rayleigh": rayleigh_of(spec),
    }  # fmt: skip
    return getattr(words, code)(point)


SHEAR_MODULUS = "materials.particle.shear_modulus_Pa"


def _classes(particles):
    """[(low, high, share)] of the grains' sizes [mm]."""
    low, high = (particles.scale_factor * d for d in classes(particles.sizes))
    return list(zip(low, high, particles.sizes.fractions, strict=True))


def _keys(geometry: Part) -> Iterator[tuple]:
    """Rows of the keys of a rig, with what they mean."""
    for key, value, note in leaves(geometry, None, "geometry"):
        if value is not None:
            name, number = key.partition(".")[2], isinstance(value, int | float)
            words = f"{note or name.rpartition('.')[2]} (`{name}`)"
            yield words, value if number else str(value), in_ascii(unit_of(key)) if number else ""
