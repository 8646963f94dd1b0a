"""Choices that do not depend on the last digit of a computed number.

Processors round linear algebra differently, so two numbers that are equal by the mathematics differ
by a few units in the last place, one way on one machine and the other way on another. Numbers
closer than `TIE` of the largest one count as equal here, and the first of equal ones is chosen.
"""

import numpy as np
import numpy.typing as npt

TIE = 1e-9


def first_largest(values: npt.ArrayLike) -> int:
    """Return the index of the first of values (n,) that is the largest but for rounding."""
    values = np.asarray(values, float)
    return int(np.argmax(values >= values.max() - _tie(values)))


def first_least(values: npt.ArrayLike) -> int:
    """Return the index of the first of values (n,) that is the least but for rounding."""
    return first_largest(-np.asarray(values, float))


def largest_first(values: npt.ArrayLike) -> np.ndarray:
    """Return the order (n,) of values (n,) from the largest to the least; those that are equal but
    for rounding stay in their order."""
    values = np.asarray(values, float)
    order = np.argsort(-values, kind="stable")
    tie, group, first = _tie(values), np.zeros(len(values), int), 0
    for k in range(1, len(order)):
        if values[order[first]] - values[order[k]] > tie:
            first = k
        group[k] = first
    return order[np.lexsort((order, group))]


def _tie(values):
    finite = np.abs(values[np.isfinite(values)])
    return TIE * finite.max(initial=0.0)
