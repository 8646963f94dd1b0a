"""Numbers as a reader sees them: no zero has a sign, and no spread is written as zero."""

import math

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


def spread(sd: float, digits: int) -> str:
    """A standard deviation > 0 with so many decimals, or with one digit where they show none."""
    if round(sd, digits):
        return f"{sd:.{digits}f}"
    return f"{sd:.{-math.floor(math.log10(sd))}f}"
