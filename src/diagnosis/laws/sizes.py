"""Sizes of shared errors that are tried."""

from collections.abc import Iterable
from itertools import combinations
from typing import Any

import numpy as np

TIMES = (1.5, 4.0, 10.0)
"""Standard deviations of a shared error that are tried, in units of the median error of a setting;
and none."""

USUAL = 2.0  # scale of their prior, in the same unit


def combined(names: Iterable[Any]) -> tuple[list[dict[Any, float]], np.ndarray]:
    """[{name: times}] of the sizes that are tried of the kinds of error in `names`, at most two
    kinds at once, and the log prior (g,) of each."""
    choices = [{}]  # type: ignore[var-annotated]
    for count in (1, 2):
        for chosen in combinations(names, count):
            for times in np.array(np.meshgrid(*[TIMES] * count)).reshape(count, -1).T:
                choices.append(dict(zip(chosen, times, strict=True)))
    prior = np.array([-sum(np.log1p((t / USUAL) ** 2) for t in c.values()) for c in choices])
    return choices, prior
