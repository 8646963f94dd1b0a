"""What a force law is written with: functions for a float and for lanes alike, and the decorator of
a law.

Nothing here loads numba: a law's file is read for what it declares long before anything is
compiled. `dem.lanes` gives each function its compiled form.
"""

import functools
import math

OPTIONS = {"forceinline": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}


class Kernel:
    """A function of a law: compiled for floats or lanes when something compiled calls it, and
    inlined there."""

    def __init__(self, function):
        functools.update_wrapper(self, function)
        self.py_func = function

    @functools.cached_property
    def compiled(self):
        """The numba function."""
        from numba import njit

        import dem.lanes  # noqa: F401  # gives the functions below their compiled form

        return njit(**OPTIONS)(self.py_func)

    @property
    def _numba_type_(self):
        return self.compiled._numba_type_

    def __call__(self, *arguments):
        return self.compiled(*arguments)


law = Kernel
"""Decorator of a force law."""


def sqrt(x):
    """Square root."""
    return math.sqrt(x)


def power(x, exponent):
    """`x ** exponent` for x >= 0 and a uniform exponent."""
    return x**exponent


def where(condition, a, b):
    """`a` where the condition holds, else `b`; both are evaluated."""
    return a if condition else b


def maximum(a, b):
    """The larger of two numbers."""
    return a if a > b else b


def minimum(a, b):
    """The smaller of two numbers."""
    return a if a < b else b


def narrow(x):
    """Lanes: float64 to float32. A plain float is left as it is, so the reference path stays in
    float64."""
    return x


def widen(x):
    """Lanes: float32 to float64. A plain float is left as it is."""
    return x


def any_lane(condition):
    """Whether the condition holds for any contact of the vector."""
    return condition
