"""What a force law is written with: functions for a float and for lanes alike.

Nothing here loads numba: a law's file is read for what it declares long before anything is
compiled. `dem.kernel.simd` gives each function its compiled form.
"""

import math
from typing import Any


def sqrt(x: Any) -> Any:
    """Square root."""
    return math.sqrt(x)


def power(x: Any, exponent: float) -> Any:
    """`x ** exponent` for x >= 0 and a uniform exponent."""
    return x**exponent


def where(condition: Any, a: Any, b: Any) -> Any:
    """`a` where the condition holds, else `b`; both are evaluated."""
    return a if condition else b


def maximum(a: Any, b: Any) -> Any:
    """The larger of two numbers."""
    return a if a > b else b


def minimum(a: Any, b: Any) -> Any:
    """The smaller of two numbers."""
    return a if a < b else b


def narrow(x: Any) -> Any:
    """Lanes: float64 to float32. A plain float is left as it is, so the reference path stays in
    float64."""
    return x


def widen(x: Any) -> Any:
    """Lanes: float32 to float64. A plain float is left as it is."""
    return x


def any_lane(condition: Any) -> Any:
    """Return whether the condition holds for any contact of the vector."""
    return condition
