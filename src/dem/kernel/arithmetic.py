"""What a force law is written with: its decorator, and functions and three-vectors (tuples) for a
float and for lanes alike.

Nothing here loads numba: a law's file is read for what it declares long before anything is
compiled. `dem.kernel.simd` gives each function its compiled form.
"""

import functools
import math
from collections.abc import Callable
from typing import Any

TINY = 1e-30
OPTIONS = {"forceinline": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}


class Kernel:
    """A function of a law: compiled for floats or lanes when something compiled calls it, and
    inlined there."""

    def __init__(self, function: Callable) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function

    @functools.cached_property
    def compiled(self) -> Any:
        """The numba function."""
        from numba import njit

        import dem.kernel.simd  # noqa: F401  # gives the functions here their compiled form

        return njit(**OPTIONS)(self.py_func)  # type: ignore[call-overload]

    @property
    def _numba_type_(self):
        return self.compiled._numba_type_

    def __call__(self, *arguments):
        return self.compiled(*arguments)


law = Kernel
"""Decorator of a force law."""


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


# --- three-vectors --------------------------------------------------------------------------------


@law
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@law
def cross(a, b):
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@law
def add(a, b):
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@law
def subtract(a, b):
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@law
def scale(factor, a):
    """factor * a."""
    return (factor * a[0], factor * a[1], factor * a[2])


@law
def reject(a, n):
    """The part of `a` that is normal to the unit vector `n`."""
    return subtract(a, scale(dot(a, n), n))


@law
def turned_about(a, n, angle):
    """`a`, normal to the unit vector `n`, turned about it by a small angle [rad]; its length is
    kept to angle^4 / 8."""
    return add(scale(1.0 - 0.5 * angle * angle, a), scale(angle, cross(n, a)))


@law
def at_most(limit, a):
    """`a`, shortened to the length `limit` where it is longer. Neither root nor division where no
    lane is: most contacts of a packing stick. Where both are nothing the quotient is no number,
    which `minimum` does not choose."""
    square = dot(a, a)
    if any_lane(square >= limit * limit):
        a = scale(minimum(limit / sqrt(square), 1.0), a)
    return a


@law
def only(condition, a):
    """`a` where the condition holds, else nothing."""
    return (where(condition, a[0], 0.0), where(condition, a[1], 0.0), where(condition, a[2], 0.0))
