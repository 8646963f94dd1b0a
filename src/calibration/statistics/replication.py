"""How many replicates the mean needs: Stein's two-stage rule.

Stein (1945), Annals of Mathematical Statistics 16:243. The spread of a first sample decides how
many values there are in all; the interval of their mean takes the first sample's spread and its
degrees of freedom. The mean of all and that spread are independent, so the interval holds the true
mean as often as it states, whatever the spread is. A sample that simply ends where its own interval
is narrow enough ends too early too often.
"""

from collections.abc import Sequence
from math import ceil, sqrt

import numpy as np
import scipy

ALPHA = 0.05


def runs_needed(first: Sequence[float] | np.ndarray, half_width: float, at_most: int) -> int:
    """Number of normal values in all, the first ones among them, so that the 95 % interval of
    their mean reaches no further than `half_width` to a side; no more than `at_most`, whose
    interval is wider and holds the true mean as often.

    first : (n,) values of the first sample, two or more
    half_width : above 0, in the values' unit
    """
    needed = ceil((_reach(first) / half_width) ** 2)
    return max(len(first), min(needed, at_most))


def mean_interval(values: Sequence[float] | np.ndarray, first: int) -> tuple[float, float]:
    """(mean, half width) of the 95 % interval of the true mean.

    values : (n,) all values, of which the leading `first` decided how many there are; where no
        others were added, it is Student's interval
    """
    return float(np.mean(values)), _reach(values[:first]) / sqrt(len(values))


def _reach(first):
    """Half width [the values' unit] of the interval of a single value."""
    return float(scipy.special.stdtrit(len(first) - 1, 1.0 - ALPHA / 2.0) * np.std(first, ddof=1))
