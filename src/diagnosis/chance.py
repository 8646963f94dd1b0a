"""Chance: what it makes of a statistic, how near two causes may lie to be told apart, and the
logarithm of a sum of probabilities."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

CLOSE = 2.0  # nats; causes this close to the best are not told apart (odds of about 7 to 1)


def share_above(sample: np.ndarray, value: ArrayLike) -> Any:
    """Share of a simulated sample (r,) at or above a value, or above each of values (n,); the value
    itself is counted in."""
    above = (np.asarray(sample) >= np.asarray(value)[..., None]).sum(-1)
    share = (1 + above) / (1 + len(sample))
    return share if np.ndim(value) else float(share)


def log_sum(values: ArrayLike, axis: int | tuple[int, ...] | None = None) -> Any:
    """Logarithm of the sum of exponentials of finite values over axes; over all a number.

    scipy.special.logsumexp does the same at ten times the cost where arrays are small, and a
    diagnosis asks for ten thousand of them."""
    values = np.asarray(values)
    top = values.max(axis=axis, keepdims=True)
    total = np.log(np.exp(values - top).sum(axis=axis, keepdims=True)) + top
    return total.squeeze(axis) if axis is not None else total.item()
