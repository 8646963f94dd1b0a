"""Pages for programs that are filled in by hand: the calibrated model as tables to type in, each
value with its interval and where it came from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from calibration.engines.blocks.material import Granulate
from dem.grains import classes, longest_mm, spheres_in
from dem.spec import RunSpec
from dem.units import without_unit

PLAIN = ("parameter", "value", "unit")
OTHERS_HELD = "interval_95_others_held"
INTERVALS = {
    OTHERS_HELD: "95 %, the others held",
    "interval_95": "95 %, whatever the others are",
}
"""Headings of a table, and of the intervals that an entry of calibrated.yaml may have."""
OPEN = "NOT BOUNDED BY THE DATA"
WHY = (
    f"{OPEN}: the interval ends at the border of the region that was searched. The measurements "
    "allow values beyond it, and the value is one of many that give the measured response."
)
SIDES = {"low": "below", "high": "above"}
GRAIN, EQUIPMENT = "materials.particle", "materials.wall"
BULK, AT_WALL = "contacts.particle_particle", "contacts.particle_wall"


@dataclass(frozen=True)
class Row:
    """A value to type in.

    key : of the run spec, to find where the value came from; "" where there is none
    """

    parameter: str
    value: float | str
    unit: str = ""
    key: str = ""


@dataclass(frozen=True)
class Expected:
    """What the calibrated model gives in the runs that validated it, in the unit of the metric.

    low, high : ends between which 95 % of single heaps lie
    """

    metric: str
    unit: str
    mean: float
    sd: float
    runs: int
    low: float
    high: float

    @property
    def sentence(self) -> str:
        """What the other program has to give."""
        words = without_unit(self.metric).replace("_", " ")
        return (
            f"**To expect: {words} {self.mean:.2f} {self.unit}**, the mean of {self.runs} "
            f"runs (sd {self.sd:.2f}). A single run lies between {self.low:.2f} and "
            f"{self.high:.2f} {self.unit} (95 %)."
        )


def page(
    title: str,
    about: Sequence[str],
    expected: Expected | None,
    said: Sequence[str],
    sections: Sequence[str],
) -> str:
    """Markdown of a page; about: lines of provenance; said: what the reader must know before the
    sections."""
    head = [f"# {title}: the calibrated model, to type in", *about]
    told = [expected.sentence] if expected else []
    return "\n\n".join([*head, *told, *said, *sections]) + "\n"


def table(rows: Sequence[Row], known: Mapping[str, Mapping] | None = None) -> str:
    """Markdown table of rows; known: {key: entry of calibrated.yaml}, or None where nothing of it
    was calibrated."""
    given = {key for entry in (known or {}).values() for key in entry}
    kind = next((key for key in INTERVALS if key in given), OTHERS_HELD)
    heads = (*PLAIN, INTERVALS[kind], "where from") if known else PLAIN
    cells = [heads, ["---"] * len(heads), *(_cells(row, known, kind) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


def _cells(row, known, kind):
    value = row.value if isinstance(row.value, str) else f"{row.value:.6g}"
    plain = [row.parameter, value, row.unit]
    entry = known.get(row.key, {}) if known else None
    return plain if entry is None else [*plain, _interval(entry.get(kind)), _source(entry)]


def _interval(ends):
    return "{:.4g} to {:.4g}".format(*ends) if ends else ""


def _source(entry):
    found = [entry["source"]] if "source" in entry else []
    if "paper" in entry:
        found.append(f"printed in {entry['paper']}")
    sides = entry.get("not_bounded_by_the_data", ())
    if sides:
        found.append(f"**{OPEN}** {' and '.join(SIDES[s] for s in sides)}")
    return "; ".join(found)


def notes(known: Mapping[str, Mapping]) -> list[str]:
    """Sentences that the whole page needs: what is not bounded, what is softened."""
    out = [WHY] if any("not_bounded_by_the_data" in e for e in known.values()) else []
    modulus = known.get(f"{GRAIN}.shear_modulus_Pa", {})
    if modulus:
        printed = f" Printed in {modulus['paper']}." if "paper" in modulus else ""
        out.append(
            f"The grains' shear modulus is that of the runs, {modulus['value']:.3g} Pa: a softened "
            "one allows a longer time step. The calibrated numbers belong to it, so type it in as "
            f"it is.{printed}"
        )
    return out


def material_rows(material: Granulate, wall: bool) -> list[Row]:
    """Elastic constants and density of the grains, or of the walls."""
    own, part = (material.wall, EQUIPMENT) if wall else (material.grain, GRAIN)
    return [
        Row("Poisson's ratio", own.poisson_ratio, "", f"{part}.poisson_ratio"),
        Row("Solids density", own.density, "kg/m3", f"{part}.density_kg_m3"),
        Row("Shear modulus", own.shear_modulus, "Pa", f"{part}.shear_modulus_Pa"),
        Row("Young's modulus (instead)", own.young_modulus, "Pa"),
    ]


def contact_rows(material: Granulate, wall: bool) -> list[tuple[str, float, str]]:
    """(what, value, key) of restitution, static and rolling friction of a pair of materials."""
    pair, part = (material.grain_wall, AT_WALL) if wall else (material.grain_grain, BULK)
    names = ("restitution", "static_friction", "rolling_friction")
    return [(name, getattr(pair.contact, name), f"{part}.{name}") for name in names]


def shape(spec: RunSpec) -> list[str]:
    """Sentences on the grain's shape and sizes. Lengths in mm."""
    p = spec.particles
    if p.clump is not None:
        spheres = "; ".join(f"({x:g}, {y:g}, {z:g}), radius {r:g}"
                            for x, y, z, r in spheres_in(p.clump))  # fmt: skip
        form = (
            f"A multi-sphere, centres and radii in units of its own: {spheres}. The largest grain "
            f"is {longest_mm(spec):.6g} mm long."
        )
    elif p.elongation != 1.0:
        form = (
            f"A multi-sphere of two spheres along one axis, {p.elongation:g} times as long as wide."
            " The diameters are those of a sphere of its volume."
        )
    else:
        form = "A single sphere."
    return [form, _sizes(spec)]


def _sizes(spec):
    p = spec.particles
    if p.sizes is None:
        return f"One size: diameter {p.diameter_mm * p.scale_factor:.6g} mm."
    rows = [
        f"{low:.6g} mm: {share:.4g}" if low == high else f"{low:.6g} to {high:.6g} mm: {share:.4g}"
        for low, high, share in zip(
            *(p.scale_factor * d for d in classes(p.sizes)), p.sizes.fractions, strict=True
        )
    ]
    return f"Diameters and their shares by {p.sizes.by}: {'; '.join(rows)}."
