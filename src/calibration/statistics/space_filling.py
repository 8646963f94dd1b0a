"""Points that fill a box evenly, for emulators that are to hold everywhere in it."""

import numpy as np
import scipy


def space_filling(count: int, d: int, seed: int) -> np.ndarray:
    """Points (count, d) in [0, 1]^d, the first of a scrambled Sobol sequence (Owen 1998, Journal of
    Complexity 14:466)."""
    doublings = max(int(np.ceil(np.log2(count))), 1)
    points: np.ndarray = scipy.stats.qmc.Sobol(d, seed=seed).random_base2(doublings)
    return points[:count]
