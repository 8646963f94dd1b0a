"""Definitive screening designs from conference matrices."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError
from calibration.statistics.design import MAX_SCREENING, tabulate
from calibration.statistics.factor import CodedFactor

ORDERS = {4: 3, 6: 5, 8: 7, 10: 9, 12: 11, 14: 13, 18: 17, 20: 19, 24: 23}
"""Order of a conference matrix: the field it is made from (Paley 1933, Journal of Mathematics and
Physics 12:311)."""


def definitive_screening(
    factors: Sequence[CodedFactor], centre_runs: int = 1, replicates: int = 1
) -> pd.DataFrame:
    """Definitive screening design for 1 to 23 factors (Jones and Nachtsheim 2011, Journal of
    Quality Technology 43:1).

    Each conference matrix row, the same with all signs changed, and the centre: 2 m + 1 runs for a
    matrix of order m. An odd number of factors, or an order without a matrix, takes the next larger
    one and drops columns (Xiao, Lin and Bai 2012, Journal of Quality Technology 44:2): 17 runs for
    seven factors. Main effects are clear of each other, of two-factor interactions and of
    curvature. Raises CalibrationError for another number of factors.
    """
    k = len(factors)
    if not 1 <= k <= MAX_SCREENING:
        raise CalibrationError(f"screening takes 1 to {MAX_SCREENING} factors, not {k}")
    if centre_runs < 1:
        raise CalibrationError("a definitive screening design has a run at the centre")
    matrix = conference_matrix(next(m for m in ORDERS if m >= k))[:, :k]
    matrix = np.vstack([np.stack([matrix, -matrix], 1).reshape(-1, k), np.zeros((centre_runs, k))])
    return tabulate(matrix, factors, replicates)


def conference_matrix(order: int) -> np.ndarray:
    """Matrix (m, m) of 0 on the diagonal and -1 and +1 elsewhere with C' C = (m - 1) I.

    Paley's: a border of ones about the quadratic characters of differences in a field of m - 1
    elements. Raises CalibrationError for an order that is not in ORDERS.
    """
    if order not in ORDERS:
        known = ", ".join(map(str, ORDERS))
        raise CalibrationError(f"no conference matrix of order {order}; known: {known}")
    character = _characters(ORDERS[order])
    below = 1.0 if np.array_equal(character, character.T) else -1.0
    matrix = np.zeros((order, order))
    matrix[0, 1:], matrix[1:, 0] = 1.0, below
    matrix[1:, 1:] = character
    return matrix


def _characters(q):
    """(q, q) matrix of 1 where the difference of two elements of the field of q is a square, -1
    where not, 0 at 0."""
    if q == 9:
        return _characters_of_nine()
    squares = {i * i % q for i in range(1, q)}
    value = np.array([0.0] + [1.0 if i in squares else -1.0 for i in range(1, q)])
    index = np.arange(q)
    return value[(index[:, None] - index) % q]


def _characters_of_nine():
    """The field of nine: a + b i with a, b modulo 3 and i i = -1."""
    elements = [(a, b) for a in range(3) for b in range(3)]
    squares = {((a * a - b * b) % 3, 2 * a * b % 3) for a, b in elements if (a, b) != (0, 0)}

    def character(x, y):
        difference = ((x[0] - y[0]) % 3, (x[1] - y[1]) % 3)
        return 0.0 if difference == (0, 0) else 1.0 if difference in squares else -1.0

    return np.array([[character(x, y) for y in elements] for x in elements])
