"""Printed figures: their value and the rounding that their digits allow."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

_NUMBER = re.compile(
    r"^(?P<relation>[<>]?)\s*(?P<mantissa>[+-]?\d+(?:\.(?P<decimals>\d+))?)"
    r"(?:[eE](?P<power>[+-]?\d+))?$"
)


@dataclass(frozen=True)
class Printed:
    """A printed number: its value, half a unit in its last printed place, and its relation ('', '<'
    or '>')."""

    text: str
    value: float
    half_unit: float
    relation: str = ""

    @classmethod
    def parse(cls, text: str) -> "Printed | None":
        """The number in `text`, or None where the text is not one number.

        >>> Printed.parse("0.40").half_unit
        0.005
        >>> Printed.parse("<0.0001").relation
        '<'
        """
        match = _NUMBER.match(text.strip())
        if match is None:
            return None
        power = int(match["power"] or 0)
        half_unit = 0.5 * 10.0 ** (power - len(match["decimals"] or ""))
        return cls(
            text.strip(), float(f"{match['mantissa']}e{power}"), half_unit, match["relation"]
        )


def propagate(f: Callable[[Sequence[float]], float], inputs: Sequence[Printed]) -> float:
    """Largest change of `f(values)` when each input moves by half a unit in its last printed place,
    to first order."""
    values = [x.value for x in inputs]
    centre = f(values)
    moved = ([*values[:i], x.value + x.half_unit, *values[i + 1 :]] for i, x in enumerate(inputs))
    return float(sum(abs(f(point) - centre) for point in moved))
