"""Numbers as a reader sees them: no zero has a sign, and no spread is written as zero."""

import math
from collections.abc import Mapping
from typing import Any

NORMAL_95 = 1.96
"""Half of the 95 % interval of a normal distribution, in standard deviations."""


def fixed(value: float, digits: int, sign: str = "") -> str:
    """A number with so many decimals; `sign` "+" writes the sign of a positive one too."""
    text = f"{value:{sign}.{digits}f}"
    return text.lstrip("+-") if float(text) == 0 else text


def signed(value: float) -> str:
    """A difference to three digits with its sign, a true minus; 0 without one."""
    text = f"{value:+.3g}".replace("-", "−")
    return "0" if float(f"{value:.3g}") == 0 else text


def difference_of(found: Mapping[str, Any]) -> tuple[str, str, str]:
    """(difference, low, high) in words, of a comparison (a mapping with `difference`,
    `difference_low`, `difference_high` in one unit): all to the decimals that give the farther end
    of the interval three digits. A difference has no digits that its interval does not bear."""
    values = [found["difference"], found["difference_low"], found["difference_high"]]
    most = max(map(abs, values))
    decimals = max(0, 2 - math.floor(math.log10(most))) if most > 0 else 0
    said = [fixed(value, decimals, "+").replace("-", "−") for value in values]
    return said[0], said[1], said[2]


def spread(sd: float, digits: int) -> str:
    """A standard deviation > 0 with so many decimals, or with one digit where they show none."""
    if round(sd, digits):
        return f"{sd:.{digits}f}"
    return f"{sd:.{-math.floor(math.log10(sd))}f}"
