"""The decorator of a force law. Nothing is compiled before something compiled calls the law."""

import functools
from collections.abc import Callable
from typing import Any

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

        import dem.kernel.simd  # noqa: F401  # gives `dem.kernel.arithmetic` its compiled form

        return njit(**OPTIONS)(self.py_func)  # type: ignore[call-overload]

    @property
    def _numba_type_(self):
        return self.compiled._numba_type_

    def __call__(self, *arguments):
        return self.compiled(*arguments)


law = Kernel
"""Decorator of a force law."""
