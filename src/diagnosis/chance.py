"""What chance makes of a statistic, and how near two causes may lie to be told apart."""

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
