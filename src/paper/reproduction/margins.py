"""The margins of agreement: differences that do not matter, stated by kind of quantity and not by
result.

An angle's margin is the one that the validation of a study takes by default. Other quantities get a
share of the printed value; what is computed from responses gets the margin of the response.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from paper.audit.paper import Printed


ANGLE_DEG = 1.0
"""Of angles, effects on angles and coefficients in coded levels: the default of
`validation.margin`."""
SHARE = 0.05
"""Of lengths, frictions, restitutions and slopes: a share of the printed value."""
R2 = 0.05
"""Of coefficients of determination, which are shares already."""
SCATTER_SHARE = 0.25
"""Of measures of scatter (standard deviation, CV, adequate precision): known to a fifth from ten
repeats."""
SCALING = {"heap": 2.0, "drop": 0.02}
"""Of the range over scales [deg; 1]: the defaults of the scaling study."""


def by_unit(unit: str, value: float) -> float:
    """Margin of a quantity in `unit` whose printed value is `value`."""
    return ANGLE_DEG if unit == "deg" else SHARE * abs(value)


def of_printing(printed: Printed) -> float:
    """Half a unit of the last printed place: what an exactly recomputed figure may differ by."""
    return printed.half_unit * (1.0 + 1e-9)


def of_coefficient(response_margin: float, levels: Sequence[float], power: int) -> float:
    """Margin of a polynomial's coefficient: what moves the response by its own margin at the end of
    the range.

    levels: (n,) of the factor; the range counts from its middle for the powers, and fully for the
    constant.
    """
    half = 0.5 * (max(levels) - min(levels))
    return response_margin / math.pow(half, power)
