"""Tables 1 to 4 and Section 1.1: the measured angle, the sieves, the density and the materials; and
what each citation shows."""

from calibration.statistics.dimensions import DIMENSIONS
from paper.audit.paper import Cells, Claims, Found, Paper, Printed

UNITS = {
    "kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "Pa": (1, -1, -2), "N": (1, 1, -2),
    "1": (0, 0, 0),
}  # fmt: skip
"""Unit: powers of mass, length and time."""
RIGHT_UNITS = {"density": "kg m-3", "modulus": "Pa", "angle": "1"}
SIEVES_MM = ("0.3", "0.5", "1", "1.43", "2")
CALLED_STEEL = "The density beside it is the salt's: Section 1.1 lists the salt and calls it steel"
CUT_OFF = "The figure is cut off, not rounded: no consequence."
SIEVED, DENSITY = "table02_sieve_fractions", "table03_density"


def salt_crystal_density(paper: Paper) -> float:
    """Density of the NaCl crystal from its unit cell, kg/m3."""
    names = ("nacl_formula_units", "nacl_molar_mass", "avogadro", "nacl_lattice_constant")
    count, molar_mass, avogadro, lattice_nm = map(paper.value, names)
    return count * molar_mass * 1e-3 / avogadro / (lattice_nm * 1e-9) ** 3


def intrinsic(paper: Paper, parameter: str) -> Printed:
    """A value of Table 4 with its printed digits."""
    names = paper.text("table04_intrinsic", "parameter").parameter
    return dict(zip(names, paper.printed("table04_intrinsic", "value"), strict=True))[parameter]


def _readings(paper, claim):
    sizes = paper.angles().groupby("group").size()
    return sizes.iloc[0] if sizes.nunique() == 1 else ", ".join(map(str, sizes))


def _group_mean(readings, row):
    return readings.groupby("group").angle_deg.mean()[float(row["group"])]


def _sieve_sums(paper, claim):
    rows = zip(*(paper.printed(SIEVED, sieve) for sieve in SIEVES_MM), strict=True)
    found = {}
    for group, row in zip(paper.text(SIEVED, "group").group, rows, strict=True):
        total, half_width = sum(x.value for x in row), sum(x.half_unit for x in row)
        side = "missing" if total < 100 else "too many"
        found[f"group{group}"] = Found(total, half_width, gap=abs(total - 100), side=side)
    return found


def _density(paper, row):
    density = 1000 * float(row["mass_g"]) / float(row["volume_cm3"])
    cut_off = int(density) == float(row[row["cell"]])
    return Found(density, why=CUT_OFF if cut_off else "Mass over volume gives another figure.")


def _particle_density(paper, claim):
    names = ("brine_density", "loosest_packing", "densest_packing")
    brine, low, high = map(paper.value, names)
    crystal, printed = salt_crystal_density(paper), claim.value
    share = printed / crystal
    return Found(
        crystal, share=share, low=low, high=high, light=1 / share, number=printed, brine=brine,
        apart=abs(printed / brine - 1), is_not="a" if low <= share <= high else "not a",
    )  # fmt: skip


def _brine_volume(paper, claim):
    """The least liquid that fills the voids of the sample at its densest packing."""
    mass_g = paper.numbers(DENSITY, "mass_g").mass_g.max()
    solid = 1000 * mass_g / salt_crystal_density(paper)
    voids = solid * (1 / paper.value("densest_packing") - 1)
    return Found(voids, holds=claim.value >= voids, mass=mass_g)


def _unit(paper, row):
    parameter = row["parameter"]
    quantity = next((q for q in ("density", "modulus") if parameter.endswith(q)), "angle")
    holds = unit_dimension(row["printed_unit"]) == DIMENSIONS[quantity]
    return Found(RIGHT_UNITS[quantity], holds=holds, shown=parameter.replace("_", " "))


def unit_dimension(unit: str) -> tuple[int, ...] | None:
    """Powers of mass, length and time of a unit such as "kg m-3". None if a part of it is not
    known."""
    total = [0, 0, 0]
    for token in unit.split():
        name = token.rstrip("-0123456789") or token
        if name not in UNITS:
            return None
        power = int(token[len(name) :] or 1)
        total = [t + power * d for t, d in zip(total, UNITS[name], strict=True)]
    return tuple(total)


def _of_steel(paper, claim):
    """A value of steel in Table 4 in the claim's unit."""
    names = {"poisson": "poisson_ratio", "shear": "shear_modulus"}
    given = intrinsic(paper, f"steel_{names.get(claim.part, claim.part)}")
    scale = 1e-6 if claim.unit == "MPa" else 1.0
    salts = paper.value("section_1_1_density") == intrinsic(paper, "salt_density").value
    reason = CALLED_STEEL if salts else "Section 1.1 and Table 4 differ"
    return Found(given.value * scale, given.half_unit * scale, reason=reason)


def _citation(paper, row):
    labels = paper.text("labels", "label", "shows")
    right = list(labels.label[labels.shows == row["about"]])
    kind = row["cites"].split()[0]
    first = next(iter(sorted(right, key=lambda label: not label.startswith(kind))), None)
    value = row["cites"] if row["cites"] in right else first or "nothing printed"
    return Found(value, named=first or "none")


def _unique_labels(paper, claim):
    counts = paper.text("labels", "label").label.value_counts()
    twice = sorted(counts.index[counts > 1])
    return Found(len(twice), twice=", ".join(twice))


CLAIMS: Claims = {
    "table01.mean": lambda paper, _: paper.angles().angle_deg.mean(),
    "table01.groups": lambda paper, _: paper.angles().group.nunique(),
    "table01.readings": _readings,
    "table02.sum": _sieve_sums,
    "table03.mean": lambda paper, _: paper.numbers(DENSITY)["density_printed_kg_m3"].mean(),
    "table03.particle": _particle_density,
    "table03.brine": _brine_volume,
    "section11.density section11.poisson section11.shear": _of_steel,
    "section235.poisson": lambda paper, _: (
        None if paper.optional("salt_poisson_ratio") is None else "calibrated"
    ),
    "labels.unique": _unique_labels,
}
CELLS: Cells = {
    "table01.mean.{group}": (
        "table01_printed_means", "mean", lambda paper, row: _group_mean(paper.angles(), row)
    ),
    "table13.mean.{group}": (
        "table13_printed_means", "mean",
        lambda paper, row: _group_mean(paper.numbers("table13_validation"), row),
    ),
    "table02.mean.{sieve_mm}": (
        "table02_printed_means", "mean",
        lambda paper, row: paper.numbers(SIEVED, row["sieve_mm"]).iloc[:, 0].mean(),
    ),
    "table03.density.{row}": (DENSITY, "density_printed_kg_m3", _density),
    "table04.unit.{parameter}": ("table04_printed_units", "printed_unit", _unit),
    "reference.{id}": ("cross_references", "cites", _citation),
}  # fmt: skip
