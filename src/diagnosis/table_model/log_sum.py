"""The logarithm of a sum of probabilities that are known by their logarithms."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def log_sum(values: ArrayLike, axis: int | tuple[int, ...] | None = None) -> Any:
    """Logarithm of the sum of exponentials of finite values over axes; over all a number.

    scipy.special.logsumexp does the same at ten times the cost where arrays are small, and a
    diagnosis asks for ten thousand of them."""
    values = np.asarray(values)
    top = values.max(axis=axis, keepdims=True)
    total = np.log(np.exp(values - top).sum(axis=axis, keepdims=True)) + top
    return total.squeeze(axis) if axis is not None else total.item()
