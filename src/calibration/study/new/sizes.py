"""Sizes of grains out of a sieve analysis: what passes each sieve or stays on it."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError, ConfigError
from calibration.intake.numbers_with_units import plausible_numbers
from calibration.intake.tables import read_table
from calibration.study.new.reading_tables import with_points

SIEVE_HEADINGS = {
    "diameter_mm": {"diameter", "size", "sieve", "durchmesser", "siebweite", "maschenweite",
                    "korngröße", "korngrösse", "diamètre", "diametre", "maille", "taille"},
    "passing_percent": {"passing", "siebdurchgang", "durchgang", "passant", "tamisat"},
    "mass_percent": {"mass", "masse", "massenanteil", "masseanteil", "anteil", "fraction massique"},
    "retained": {"retained", "rückstand", "rueckstand", "siebrückstand", "rest", "refus",
                 "refus partiel"},
}  # fmt: skip
"""Column -> what laboratories call it, in small letters; the unit has to stand behind it."""
SIEVE_UNITS = {"passing_percent": ("%",), "mass_percent": ("%",), "retained": ("%", "g", "kg")}


def _sieve_columns(table):
    """{column as it is here: its heading in the table}. Raises CalibrationError for two headings
    that mean one column, or a heading without the unit that it needs."""
    found = {}
    for heading in table.header:
        known = (c for c, names in SIEVE_HEADINGS.items() if heading.lower() in names)
        column = heading if heading in SIEVE_HEADINGS else next(known, None)
        where = {"path": table.path, "line": table.header_line, "column": heading}
        if column in found:
            raise ConfigError(f"means the same as {found[column]}", **where, allowed="one of them")
        if column and heading != column:
            unit, needed = table.units.get(heading), SIEVE_UNITS.get(column)
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
        near = "; are they shares of 1?" if abs(total - 1) < 0.01 else ""
        raise CalibrationError(f"{path}: the fractions make {total:g} %; allowed: 100 %{near}")
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
    sizes = plausible_numbers(table, columns["diameter_mm"], "diameter_mm")
    for (line, _), size in zip(table.rows, sizes, strict=True):
        # what passes no sieve may stand beside the pan, a sieve of 0
        if size < 0 or (size == 0 and not passing):
            raise ConfigError("is no size", path=path, line=line, column=columns["diameter_mm"],
                              value=size, allowed="more than 0 mm")  # fmt: skip
    shares = table.numbers(columns[share])
    if share == "retained":
        shares = _passing(table, columns[share], sizes, shares)
    return _between_sieves(path, sizes, shares) if passing else (sizes, shares)


def _passing(table, heading, sieves, retained):
    """What passes each sieve [%] of what stays on it, in % or in masses. Raises ConfigError for
    shares that do not make a whole, or none at all."""
    total, unit = sum(retained), table.units[heading]
    for (line, row), mass in zip(table.rows, retained, strict=True):
        if mass < 0:
            raise table.fault(line, heading, "is no mass", row[heading], "0 or more")
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
        raise CalibrationError(
            f"{path}: the sieve of {twice:g} mm stands twice; allowed: a row for each sieve"
        )
    if any(b[1] < a[1] for a, b in pairwise(rows)):
        raise CalibrationError(
            f"{path}: less passes a wider sieve than a narrower one; allowed: passing_percent that "
            f"rises with diameter_mm (mass_percent where each row is a size)"
        )
    if rows[0][1] > 0:
        finest = f"{rows[0][0]:g} mm"
        raise CalibrationError(
            f"{path}: {rows[0][1]:g} % pass the finest sieve ({finest}), and no size is known of "
            f"them; allowed: a last row with 0 %, such as that of the pan at the finest grain"
        )
    if rows[-1][1] < 99:
        near = "; are they shares of 1?" if abs(rows[-1][1] - 1) < 0.01 else ""
        raise CalibrationError(
            f"{path}: {rows[-1][1]:g} % pass the widest sieve ({rows[-1][0]:g} mm), and no size is "
            f"known of the rest; allowed: a row with 100 %, the sieve that all of it passes{near}"
        )
    if rows[0][0] == 0 and len(rows) > 1 and rows[1][1] > 0:
        raise CalibrationError(
            f"{path}: {rows[1][1]:g} % pass the finest sieve ({rows[1][0]:g} mm) into the pan, "
            "whose size is 0; allowed: the size of the finest grain in its place"
        )
    sizes = [round(math.sqrt(a[0] * b[0]), 4) for a, b in pairwise(rows)]
    return sizes, [b[1] - a[1] for a, b in pairwise(rows)]


def mean_diameter(sizes: Mapping[str, Any]) -> float:
    """Diameter [mm] of the grain of mean volume: as many of them make the same mass."""
    d, w = sizes["diameters_mm"], sizes["fractions"]
    return (1.0 / sum(f / x**3 for f, x in zip(w, d, strict=True))) ** (1 / 3)
