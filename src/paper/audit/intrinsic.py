"""Tables 1 to 4 and Section 1.1: the measured angle, the sieves, the density and the materials."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from calibration.chain.scaling.dimensions import DIMENSIONS
from paper.audit.paper import Claim, Paper
from paper.audit.printed import Printed
from paper.audit.verdict import Recomputed, claim_check, table_check

UNIT_DIMENSIONS = {
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "Pa": (1, -1, -2),
    "N": (1, 1, -2),
    "1": (0, 0, 0),
}
SIEVES_MM = ("0.3", "0.5", "1", "1.43", "2")


def salt_crystal_density(paper: Paper) -> float:
    """Density of the NaCl crystal from its unit cell, kg/m3."""
    cell_m3 = (paper.value("nacl_lattice_constant") * 1e-9) ** 3
    cell_kg = (
        paper.value("nacl_formula_units")
        * paper.value("nacl_molar_mass")
        * 1e-3
        / paper.value("avogadro")
    )
    return cell_kg / cell_m3


def intrinsic(paper: Paper, parameter: str) -> Printed:
    """A value of Table 4 with its printed digits."""
    table = paper.text("table04_intrinsic", "parameter", "value")
    return dict(zip(table.parameter, paper.printed("table04_intrinsic", "value"), strict=True))[
        parameter
    ]


def _angles(paper: Paper) -> Any:
    return paper.angles()


@claim_check("table01.mean")
def measured_mean(paper: Paper, claim: Claim) -> Recomputed:
    mean = float(_angles(paper).angle_deg.mean())
    return Recomputed(
        mean,
        disagrees=f"The target of the calibration is {mean:.2f} deg; far inside the spread of the "
        f"readings, but every "
        "relative error in the paper is counted from the printed value.",
    )


@claim_check("table01.groups")
def measured_groups(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(int(_angles(paper).group.nunique()))


@claim_check("table01.readings")
def measured_readings(paper: Paper, claim: Claim) -> Recomputed:
    sizes = _angles(paper).groupby("group").size()
    return Recomputed(int(sizes.iloc[0]) if sizes.nunique() == 1 else ", ".join(map(str, sizes)))


@table_check
def measured_group_means(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    yield from group_means(paper, _angles(paper), "Table 1", "Mean angle of repose")


def group_means(
    paper: Paper, readings: pd.DataFrame, table: str, what: str
) -> Iterator[tuple[Claim, Recomputed]]:
    """Printed means of the groups of `readings` (columns group, angle_deg) of a table such as
    "Table 1"."""
    name = f"table{int(table.split()[1]):02d}"
    means = readings.groupby("group").angle_deg.mean()
    printed = paper.text(f"{name}_printed_means", "group", "mean")
    for group, text in zip(printed.group, printed["mean"], strict=True):
        claim = Claim(f"{name}.mean.{group}", table, f"{what} of group {group}", text, "deg")
        yield claim, Recomputed(float(means[float(group)]))


@claim_check("table02.sum")
def sieve_sums(paper: Paper, claim: Claim) -> dict[str, Recomputed]:
    name = "table02_sieve_fractions"
    cells = {sieve: paper.printed(name, sieve) for sieve in SIEVES_MM}
    rows = zip(paper.text(name, "group").group, zip(*cells.values(), strict=True), strict=True)
    return {f"group{group}": _sieve_sum(row) for group, row in rows}


def _sieve_sum(row: tuple[Printed, ...]) -> Recomputed:
    total = sum(x.value for x in row)
    gap = "missing" if total < 100 else "too many"
    return Recomputed(
        total,
        half_width=sum(x.half_unit for x in row),
        disagrees=f"{abs(total - 100):.1f} % of the sample {gap}: the size distribution of this "
        f"group cannot be used "
        "without normalising it.",
    )


@table_check
def sieve_means(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    fractions = paper.numbers("table02_sieve_fractions", *SIEVES_MM)
    printed = paper.text("table02_printed_means", "sieve_mm", "mean")
    for sieve, text in zip(printed.sieve_mm, printed["mean"], strict=True):
        claim = Claim(
            f"table02.mean.{sieve}", "Table 2", f"Mean fraction of the {sieve} mm sieve", text, "%"
        )
        yield claim, Recomputed(float(fractions[sieve].mean()))


@table_check
def densities(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    name = "table03_density"
    table = paper.numbers(name, "number", "mass_g", "volume_cm3")
    for row, printed in zip(
        table.itertuples(), paper.printed(name, "density_printed_kg_m3"), strict=True
    ):
        density = 1000 * row.mass_g / row.volume_cm3
        cut = int(density) == printed.value
        why = (
            "The figure is cut off, not rounded: no consequence."
            if cut
            else "Mass over volume gives another figure."
        )
        claim = Claim(
            f"table03.density.{row.number:.0f}", "Table 3, Eq. 16", "Density", printed.text, "kg/m3"
        )
        yield claim, Recomputed(density, disagrees=why)


@claim_check("table03.mean")
def density_mean(paper: Paper, claim: Claim) -> Recomputed:
    mean = float(paper.numbers("table03_density", "density_printed_kg_m3").mean().iloc[0])
    return Recomputed(
        mean, disagrees=f"The column averages {mean:.1f} kg/m3: rounded to tens, of no consequence."
    )


@claim_check("table03.particle")
def particle_density(paper: Paper, claim: Claim) -> Recomputed:
    crystal, brine = salt_crystal_density(paper), paper.value("brine_density")
    printed = float(claim.printed)
    share, low, high = (
        printed / crystal,
        paper.value("loosest_packing"),
        paper.value("densest_packing"),
    )
    packed = (
        f"{'a' if low <= share <= high else 'not a'} packing fraction of loose grains ({low} "
        f"to {high})"
    )
    return Recomputed(
        crystal,
        disagrees=f"The printed figure is {share:.2f} of the NaCl crystal's {crystal:.0f} kg/m3, "
        f"{packed}, and "
        f"{abs(printed / brine - 1):.0%} from the saturated brine's {brine:.0f}: a bulk figure, "
        f"not a grain's. Grains "
        f"of {printed:.0f} in a heap make it {1 / share:.1f} times too light.",
    )


@claim_check("table03.brine")
def brine_volume(paper: Paper, claim: Claim) -> Recomputed:
    """The least liquid that fills the voids of the sample at its densest packing."""
    mass_g = paper.numbers("table03_density", "mass_g").mass_g.max()
    solid = 1000 * mass_g / salt_crystal_density(paper)
    voids = solid * (1 / paper.value("densest_packing") - 1)
    return Recomputed(
        voids,
        holds=float(claim.printed) >= voids,
        disagrees=f"{mass_g:.0f} g of salt leave {voids:.0f} mL of voids even in random close "
        f"packing: the brine made "
        "from the stated water cannot cover the grains, and the volume read is the bulk's.",
    )


@table_check
def units(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    table = paper.text("table04_printed_units", "parameter", "printed_unit")
    for parameter, unit in zip(table.parameter, table.printed_unit, strict=True):
        quantity = next((q for q in ("density", "modulus") if parameter.endswith(q)), "angle")
        right, shown = (
            {"density": "kg m-3", "modulus": "Pa", "angle": "1"}[quantity],
            parameter.replace("_", " "),
        )
        claim = Claim(f"table04.unit.{parameter}", "Table 4", f"Unit of the {shown}", unit, "unit")
        holds = _unit_dimension(unit) == DIMENSIONS[quantity]
        yield claim, Recomputed(right, holds=holds, disagrees=f"A misprint: read {right}.")


def _unit_dimension(unit: str) -> tuple[int, ...] | None:
    """Powers of mass, length and time of a unit such as "kg m-3". None if a part of it is not
    known."""
    total = [0, 0, 0]
    for token in unit.split():
        name = token.rstrip("-0123456789") or token
        if name not in UNIT_DIMENSIONS:
            return None
        power = int(token[len(name) :] or 1)
        total = [t + power * d for t, d in zip(total, UNIT_DIMENSIONS[name], strict=True)]
    return tuple(total)


@claim_check("section11.density", "section11.poisson", "section11.shear")
def steel(paper: Paper, claim: Claim) -> Recomputed:
    parameter, scale = {
        "section11.density": ("steel_density", 1.0),
        "section11.poisson": ("steel_poisson_ratio", 1.0),
        "section11.shear": ("steel_shear_modulus", 1e-6),
    }[claim.id]
    given = intrinsic(paper, parameter)
    salts = paper.value("section_1_1_density") == intrinsic(paper, "salt_density").value
    reason = (
        "The density beside it is the salt's: Section 1.1 lists the salt and calls it steel"
        if salts
        else ("Section 1.1 and Table 4 differ")
    )
    return Recomputed(
        given.value * scale,
        half_width=given.half_unit * scale,
        disagrees=f"{reason}. Table 4's figure is used for the steel.",
    )


@claim_check("section235.poisson")
def salt_poisson_ratio(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        None if paper.optional("salt_poisson_ratio") is None else "calibrated",
        unknown="No test, fit or table of the paper yields the salt's Poisson ratio (Table 4 has "
        "none); the value "
        "used in the simulations must be guessed.",
    )
