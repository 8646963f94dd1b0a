"""Dimensional analysis of a particle model enlarged by the length factor h.

Every quantity q of the enlarged model is h**a times the original's. Dimensions alone decide which
exponents are free. A quantity of the dimension M^m L^l T^t has the exponent m a_M + l a_L + t a_T.
So three held quantities of independent dimensions fix all others.

Sources: Y. T. Feng, K. Han, D. R. J. Owen and J. Loughran, Engineering Computations 26 (2009)
599-609, for the laws; the paper, Eq. 2 to 8 and 15.
"""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError

QUANTITIES, GROUPS = (
    pd.read_csv(Path(__file__).with_name(f"{name}.csv"), comment="#", keep_default_na=False)
    for name in ("dimensions", "groups")
)
"""Tables of the quantities known, and of dimensionless groups as powers of them."""

DIMENSIONS = {
    q: tuple(powers)
    for q, *powers in QUANTITIES[["quantity", "mass", "length", "time"]].itertuples(index=False)
}
"""{quantity: its powers of mass, length and time}."""

HELD_IN = {
    unit: q for q, units in QUANTITIES[["quantity", "units"]].to_numpy() for unit in units.split()
}
"""Unit of a run spec's key -> the quantity that the key holds."""

MOST = 60
"""Largest denominator of an exponent."""


class ScalingError(CalibrationError):
    """A scaling rule that does not fix what is asked of it."""


PAPER = "paper"
PAPER_RULE = {"length": 1, "density": 0, "velocity": 0}
"""The paper, 1.2.2: density and velocity are invariant."""
GRAVITY_RULE = {"length": 1, "density": 0, "acceleration": 0}
"""Froude scaling: density and gravity are invariant."""
RULES = {PAPER: PAPER_RULE, "gravity-consistent": GRAVITY_RULE}
"""Scaling rules by name: the quantities that each holds, with their exponents of h."""


def exponent(quantity: str, held: Mapping[str, float]) -> Fraction:
    """Exponent of the length factor h in the factor of `quantity`: that of the product of the held
    ones which has its dimension.

    Parameters
    ----------
    quantity : key of `DIMENSIONS`
    held : the quantities held, each with its exponent of h (0: unchanged; length 1: enlarged h
    times)

    Raises ScalingError where the held exponents contradict each other, or do not fix this one.
    """
    given = np.array(list(held.values()), float)
    columns, asked = (
        np.array([DIMENSIONS[q] for q in own], float).T for own in (held, [*held, quantity])
    )
    powers = np.linalg.lstsq(columns, asked)[0]
    *own, found = given @ powers
    said = ", ".join(f"{q} ~ h^{a}" for q, a in held.items())
    if not np.allclose(own, given):
        raise ScalingError(f"the held quantities contradict each other: {said}")
    if not np.allclose(columns @ powers, asked):
        raise ScalingError(f"holding {said} leaves the exponent of {quantity} open")
    return Fraction(float(found)).limit_denominator(MOST)


def exponents(held: Mapping[str, float]) -> dict[str, Fraction]:
    """Exponent of h of every quantity in `DIMENSIONS`; raises as `exponent` does."""
    return {quantity: exponent(quantity, held) for quantity in DIMENSIONS}


def factors(held: Mapping[str, float], h: float) -> dict[str, float]:
    """Factor h**exponent of every quantity in `DIMENSIONS` for the length factor `h` > 0; raises as
    `exponent` does."""
    return {quantity: float(h) ** float(a) for quantity, a in exponents(held).items()}


def group_exponents(settings: Mapping[str, Fraction]) -> pd.DataFrame:
    """Table of the dimensionless groups of an enlarged model: group, exponent (of h, in the group),
    kept (exponent is 0). settings: exponent of h of each quantity; 0 of what is not scaled,
    whatever a rule asks: real gravity, a measured surface energy, the laboratory's funnel."""
    parts = GROUPS.assign(exponent=GROUPS["power"] * GROUPS["quantity"].map(settings))
    table = parts.groupby("group", sort=False)["exponent"].agg(sum).reset_index()
    return table.assign(kept=table["exponent"] == 0)
