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


def group_means(paper: Paper) -> Cells:
    """The printed means of Tables 1 and 13."""
    tables = {"table01": paper.angles(), "table13": paper.numbers("table13_validation")}
    for table, readings in tables.items():
        means = readings.groupby("group").angle_deg.mean()
        printed = paper.text(f"{table}_printed_means", "group", "mean")
        for group, text in zip(printed.group, printed["mean"], strict=True):
            yield (
                f"{table}.mean.{{group}}",
                text,
                Found(means[float(group)], names={"group": group}),
            )


def _sieve_sums(paper, claim):
    name = "table02_sieve_fractions"
    rows = zip(*(paper.printed(name, sieve) for sieve in SIEVES_MM), strict=True)
    found = {}
    for group, row in zip(paper.text(name, "group").group, rows, strict=True):
        total = sum(x.value for x in row)
        names = {"gap": abs(total - 100), "side": "missing" if total < 100 else "too many"}
        half_width = sum(x.half_unit for x in row)
        found[f"group{group}"] = Found(total, half_width=half_width, names=names)
    return found


def sieve_means(paper: Paper) -> Cells:
    """The printed means of Table 2."""
    fractions = paper.numbers("table02_sieve_fractions", *SIEVES_MM)
    printed = paper.text("table02_printed_means", "sieve_mm", "mean")
    for sieve, text in zip(printed.sieve_mm, printed["mean"], strict=True):
        yield "table02.mean.{sieve}", text, Found(fractions[sieve].mean(), names={"sieve": sieve})


def densities(paper: Paper) -> Cells:
    """The densities of Table 3."""
    name = "table03_density"
    table = paper.numbers(name, "number", "mass_g", "volume_cm3")
    printed = paper.printed(name, "density_printed_kg_m3")
    for row, cell in zip(table.itertuples(), printed, strict=True):
        density = 1000 * row.mass_g / row.volume_cm3
        why = (
            "The figure is cut off, not rounded: no consequence."
            if int(density) == cell.value
            else "Mass over volume gives another figure."
        )
        names = {"row": f"{row.number:.0f}", "why": why}
        yield "table03.density.{row}", cell.text, Found(density, names=names)


def _particle_density(paper, claim):
    crystal, brine = salt_crystal_density(paper), paper.value("brine_density")
    low, high = paper.value("loosest_packing"), paper.value("densest_packing")
    printed = float(claim.printed)
    share = printed / crystal
    numbers = {"share": share, "low": low, "high": high, "light": 1 / share, "number": printed}
    numbers |= {"brine": brine, "apart": abs(printed / brine - 1)}
    is_not = "a" if low <= share <= high else "not a"
    return Found(crystal, names={**numbers, "is_not": is_not})


def _brine_volume(paper, claim):
    """The least liquid that fills the voids of the sample at its densest packing."""
    mass_g = paper.numbers("table03_density", "mass_g").mass_g.max()
    solid = 1000 * mass_g / salt_crystal_density(paper)
    voids = solid * (1 / paper.value("densest_packing") - 1)
    return Found(voids, holds=float(claim.printed) >= voids, names={"mass": mass_g})


def units(paper: Paper) -> Cells:
    """The units of Table 4."""
    table = paper.text("table04_printed_units", "parameter", "printed_unit")
    for parameter, unit in zip(table.parameter, table.printed_unit, strict=True):
        quantity = next((q for q in ("density", "modulus") if parameter.endswith(q)), "angle")
        holds = unit_dimension(unit) == DIMENSIONS[quantity]
        names = {"parameter": parameter, "shown": parameter.replace("_", " ")}
        found = Found(RIGHT_UNITS[quantity], holds=holds, names=names)
        yield "table04.unit.{parameter}", unit, found


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


def _of_steel(name, scale=1.0):
    """A value of steel in Table 4, times a scale that makes it of the claim's unit."""

    def found(paper, claim):
        given = intrinsic(paper, f"steel_{name}")
        salts = paper.value("section_1_1_density") == intrinsic(paper, "salt_density").value
        reason = (
            "The density beside it is the salt's: Section 1.1 lists the salt and calls it steel"
            if salts
            else "Section 1.1 and Table 4 differ"
        )
        half_width = given.half_unit * scale
        return Found(given.value * scale, half_width=half_width, names={"reason": reason})

    return found


def _poisson_ratio(paper, claim):
    return None if paper.optional("salt_poisson_ratio") is None else "calibrated"


def citations(paper: Paper) -> Cells:
    """What the text cites."""
    labels = paper.text("labels", "label", "shows")
    cited = paper.text("cross_references", "id", "where", "cites", "about")
    for row in cited.itertuples(index=False):
        right = list(labels.label[labels.shows == row.about])
        kind = row.cites.split()[0]
        first = next(iter(sorted(right, key=lambda label: not label.startswith(kind))), None)
        value = row.cites if row.cites in right else first or "nothing printed"
        names = {"id": row.id, "where": row.where, "about": row.about, "named": first or "none"}
        yield "reference.{id}", row.cites, Found(value, names=names)


def _unique_labels(paper, claim):
    counts = paper.text("labels", "label").label.value_counts()
    twice = sorted(counts.index[counts > 1])
    return Found(len(twice), names={"twice": ", ".join(twice)})


CLAIMS: Claims = {
    "table01.mean": lambda paper, _: paper.angles().angle_deg.mean(),
    "table01.groups": lambda paper, _: paper.angles().group.nunique(),
    "table01.readings": _readings,
    "table02.sum": _sieve_sums,
    "table03.mean": lambda paper, _: paper.numbers(
        "table03_density", "density_printed_kg_m3"
    ).density_printed_kg_m3.mean(),
    "table03.particle": _particle_density,
    "table03.brine": _brine_volume,
    "section11.density": _of_steel("density"),
    "section11.poisson": _of_steel("poisson_ratio"),
    "section11.shear": _of_steel("shear_modulus", 1e-6),  # the claim is in MPa
    "section235.poisson": _poisson_ratio,
    "labels.unique": _unique_labels,
}
CELLS = group_means, sieve_means, densities, units, citations
