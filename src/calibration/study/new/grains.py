"""The grains of a study as a laboratory described them: size, shape as a clump, and whether they
stick."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from calibration.errors import ConfigError
from calibration.intake.tables import plausible_number
from calibration.study.new.assumed import ASSUMED
from calibration.study.new.methods.declare import refusal
from calibration.study.new.reading_tables import with_points
from dem.constants import GRAVITY
from dem.grains.clump import MAX_SPHERES, shape_of
from dem.tables import read_table


@dataclass(frozen=True)
class Grains:
    """Grains of a study; lengths [mm], density [kg/m3].

    diameter_mm: that of the sphere of the mean grain's volume; sizes: `particles.sizes`, or None;
    spheres: [(x, y, z, radius)] of a clump, or None; clump_file: the table that holds them; moist:
    as stated, None where not.
    """

    diameter_mm: float
    density_kg_m3: float
    sizes: dict | None = None
    spheres: tuple | None = None
    clump_file: str = ""
    moist: bool | None = None
    common_mm: float | None = None
    """Diameter of the grains in all rigs, where they stick: what holds them together holds for one
    size alone."""
    shear_modulus_Pa: float = ASSUMED.softened_Pa
    least_restitution: float = 0.2
    most: int = 4000
    """Grains that are simulated at most in the rig that leads."""

    @property
    def sticky(self) -> bool:
        """Return whether the study needs a law of cohesion: moist grains, and such as stick when
        dry."""
        return bool(self.moist) or self.diameter_mm < ASSUMED.fine_mm

    @property
    def longest(self) -> float:
        """Length of the longest grain over the mean diameter."""
        if self.sizes:
            return max(self.sizes["diameters_mm"]) / self.diameter_mm
        return shape_of(self.spheres).reach if self.spheres else 1.0

    @property
    def smallest(self) -> float:
        """Diameter of the smallest sphere over the mean grain's."""
        if self.sizes:
            return min(self.sizes["diameters_mm"]) / self.diameter_mm
        return shape_of(self.spheres).smallest if self.spheres else 1.0

    def particles(self, count: float, diameter_mm: float) -> dict:
        """Section `particles` of a run spec of `count` grains whose mean has the diameter."""
        found: dict = {"count": round(count)}
        if self.sizes:
            found["sizes"] = self.sizes
            if diameter_mm != self.diameter_mm:
                found["scale_factor"] = round(diameter_mm / self.diameter_mm, 6)
        else:
            found["diameter_mm"] = round(diameter_mm, 4)
        return found | ({"clump": {"file": self.clump_file}} if self.spheres else {})

    def size(self, wanted_mm: float) -> float:
        """Diameter of the grains of a rig that would take grains of `wanted_mm`."""
        return self.common_mm or max(wanted_mm, self.diameter_mm)

    def enlarged(self, diameter_mm: float) -> str:
        """Words for grains that are larger than the laboratory's; empty for its own."""
        ratio = diameter_mm / self.diameter_mm
        if ratio <= 1.01:
            return ""
        return f"{diameter_mm:.3g} mm, {short(ratio)} times as large as yours"

    def single(self) -> dict:
        """Section `particles` of a test of single grains, which are spheres there."""
        return {"diameter_mm": round(self.diameter_mm, 4)}


def short(number: float) -> str:
    """Three digits, or all of a whole number: never a power of ten."""
    return f"{number:,.0f}" if number >= 100 else f"{number:.3g}"


def volume_mm3(diameter_mm: float) -> float:
    """Of a sphere."""
    return math.pi / 6.0 * diameter_mm**3


def filling(volume: float, diameter_mm: float, packing: float = 0.6) -> float:
    """Grains that fill a volume [mm3]."""
    return packing * volume / volume_mm3(diameter_mm)


def energy_of_weight(diameter_mm: float, density: float) -> float:
    """Surface energy [J/m2] g at which the pull-off force of two grains, 3 pi g R* with R* a
    quarter of the diameter, is the weight of one (Johnson, Kendall, Roberts 1971)."""
    return density * GRAVITY * (1e-3 * diameter_mm) ** 2 / 4.5


def clump_of_axes(length: float, width: float, thickness: float) -> tuple | None:
    """[(x, y, z, radius)] of a grain with three axes, None for one that is nearly a sphere.

    A long grain is a rod of spheres along its length, as thick as the mean of width and thickness;
    a flat one a sphere in the middle of a ring. Raises CalibrationError for a grain that no such
    clump resembles.
    """
    a, b, c = sorted((length, width, thickness), reverse=True)
    if a < ASSUMED.round * c:
        return None
    if b > ASSUMED.flat * c:
        return _disc(a, b, c)
    return _rod(a, math.sqrt(b * c))


def _rod(length, across):
    """Spheres along a line; those at its ends are so wide that the rod has the volume of the
    ellipsoid with the same length and thickness."""
    radius = 0.5 * across
    reach = 0.5 * length - ASSUMED.narrow_end * radius
    number = 1 + 2 * math.ceil(reach / (ASSUMED.sphere_step * radius))
    if number > MAX_SPHERES:
        raise refusal("long_rod", length / across, number, MAX_SPHERES)
    wanted = 0.5 * (length * across**2) ** (1.0 / 3.0)  # radius of the sphere of its volume
    low, high = ASSUMED.narrow_end * radius, radius
    for _ in range(10):
        end = 0.5 * (low + high)
        less = shape_of(_line(length, radius, end, number)).scale < wanted
        low, high = (end, high) if less else (low, end)
    return _line(length, radius, end, number)


def _line(length, radius, end, number):
    reach = 0.5 * length - end  # of the end spheres' middles
    places = [reach * (2.0 * k / (number - 1) - 1.0) for k in range(number)]
    radii = [end if k in (0, number - 1) else radius for k in range(number)]
    return tuple((round(x, 5), 0.0, 0.0, round(r, 5)) for x, r in zip(places, radii, strict=True))


def _disc(a, b, c):
    radius = 0.5 * c
    if a > ASSUMED.flattest * c:
        raise refusal("thin_flake", a, b, c, ASSUMED.flattest)
    turns = (2.0 * math.pi * k / ASSUMED.ring for k in range(ASSUMED.ring))
    ring = [(0.5 * (a - c) * math.cos(t), 0.5 * (b - c) * math.sin(t)) for t in turns]
    return ((0.0, 0.0, 0.0, radius), *((round(x, 5), round(y, 5), 0.0, radius) for x, y in ring))


def _sieve_columns(table):
    """{column as it is here: its heading in the table}. Raises CalibrationError for two headings
    that mean one column, or a heading without the unit that it needs."""
    text = files("calibration.study.new").joinpath("sieves.yaml").read_text("utf-8")
    found, columns = {}, yaml.safe_load(text)
    for heading in table.header:
        known = (c for c, own in columns.items() if heading.lower() in own["names"])
        column = heading if heading in columns else next(known, None)
        where = {"path": table.path, "line": table.header_line, "column": heading}
        if column in found:
            raise ConfigError(f"means the same as {found[column]}", **where, allowed="one of them")
        if column and heading != column:
            unit, needed = table.units.get(heading), columns[column].get("units")
            if not unit or (needed and unit not in needed):
                allowed = (
                    f"{heading} in {' or '.join(needed or ('mm',))}, as {heading} "
                    f"[{(needed or ('mm',))[0]}]"
                )
                raise ConfigError("has no unit that tells what it is", **where, allowed=allowed)
        found |= {column: heading} if column else {}
    return found


def sieve_curve(path: str | Path) -> dict[str, Any]:
    """`particles.sizes` of a sieve table: the column `diameter_mm`, and `mass_percent` of each size
    or `passing_percent` of each sieve.

    Raises CalibrationError where they do not make 100 %.
    """
    return _distribution(path, *_sieved(path))


def size_distribution(
    sieves: Sequence[float], passing: Sequence[float], where: str | Path
) -> dict[str, Any]:
    """`particles.sizes` of what passes each sieve [mm, %]; where: for messages. Raises
    CalibrationError."""
    return _distribution(where, *_between_sieves(where, sieves, passing))


def _distribution(path, sizes, shares):
    total = sum(shares)
    if abs(total - 100) > 1 or min(shares) < 0:
        raise refusal("no_whole", path, total)
    kept = [(d, s / total) for d, s in zip(sizes, shares, strict=True) if s > 0]
    fractions = [round(s, 6) for _, s in kept]
    fractions[-1] = round(1.0 - sum(fractions[:-1]), 6)
    return {"by": "mass", "diameters_mm": [d for d, _ in kept], "fractions": fractions}


def _sieved(path):
    """(diameters [mm], mass shares [%]) of a table of sieves."""
    table = with_points(read_table(path))
    columns = _sieve_columns(table)
    share = next((c for c in ("passing_percent", "retained") if c in columns), "mass_percent")
    passing = share != "mass_percent"
    for needed in ("diameter_mm", share):
        if needed not in columns:
            table.require(needed)
    sizes = [
        plausible_number(table, line, columns["diameter_mm"], text, "diameter_mm")
        for line, text in table.texts(columns["diameter_mm"])
    ]
    for (line, _), size in zip(table.rows, sizes, strict=True):
        # what passes no sieve may stand beside the pan, a sieve of 0
        if size < 0 or (size == 0 and not passing):
            column, allowed = columns["diameter_mm"], "more than 0 mm"
            raise table.fault(line, column, "is no size", value=size, allowed=allowed)
    shares = table.numbers(columns[share])
    if share == "retained":
        shares = _passing(table, columns[share], sizes, shares)
    return _between_sieves(path, sizes, shares) if passing else (sizes, shares)


def _passing(table, heading, sieves, retained):
    """Return what passes each sieve [%] of what stays on it, in % or in masses. Raises ConfigError
    for shares that do not make a whole, or none at all."""
    total, unit = sum(retained), table.units[heading]
    for (line, row), mass in zip(table.rows, retained, strict=True):
        if mass < 0:
            raise table.fault(line, heading, "is no mass", value=row[heading], allowed="0 or more")
    if not total > 0 or (unit == "%" and abs(total - 100) > 1):
        hint = "; is it the sum over the coarser sieves?" if total > 101 and unit == "%" else ""
        raise ConfigError(
            f"the masses on the sieves make {total:g} {unit}{hint}", path=table.path,
            line=table.header_line, column=heading,
            allowed="what stays on each sieve by itself, 100 % together" if unit == "%"
            else "masses of 0 or more, and one above 0",
        )  # fmt: skip
    return [
        100.0 * sum(m for s, m in zip(sieves, retained, strict=True) if s < sieve) / total
        for sieve in sieves
    ]


def _between_sieves(path, sieves, passing):
    """(sizes, shares) of the classes between neighbouring sieves: the geometric mean of the two,
    and what passes the one and not the other. The sieves may stand in either order."""
    rows = sorted(zip(sieves, passing, strict=True))
    if twice := next((a[0] for a, b in pairwise(rows) if a[0] == b[0]), None):
        raise refusal("sieve_twice", path, twice)
    if any(b[1] < a[1] for a, b in pairwise(rows)):
        raise refusal("falling_sieves", path)
    if rows[0][1] > 0:
        raise refusal("below_finest", path, rows[0][1], rows[0][0])
    if rows[-1][1] < 99:
        raise refusal("above_widest", path, rows[-1][1], rows[-1][0])
    if rows[0][0] == 0 and len(rows) > 1 and rows[1][1] > 0:
        raise refusal("into_the_pan", path, rows[1][1], rows[1][0])
    sizes = [round(math.sqrt(a[0] * b[0]), 4) for a, b in pairwise(rows)]
    return sizes, [b[1] - a[1] for a, b in pairwise(rows)]


def mean_diameter(sizes: Mapping[str, Any]) -> float:
    """Diameter [mm] of the grain of mean volume: as many of them make the same mass."""
    d, w = sizes["diameters_mm"], sizes["fractions"]
    return (1.0 / sum(f / x**3 for f, x in zip(w, d, strict=True))) ** (1 / 3)
