"""Two-level designs of resolution IV, their foldovers and what is aliased with what."""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pandas as pd

from calibration.errors import CalibrationError
from calibration.statistics.design import MAX_SCREENING, tabulate
from calibration.statistics.factor import CodedFactor

GENERATORS = {7: "a b c d abc bcd acd", 8: "a b c d abc bcd acd abd"}
"""Published generators (Box, Hunter and Hunter 2005, table 6.22) of the 16-run designs. All others
are words of odd length, which give the same aliasing."""


def resolution_iv(
    factors: Sequence[CodedFactor], centre_runs: int = 0, replicates: int = 1
) -> pd.DataFrame:
    """The smallest two-level design of resolution IV for 1 to 23 factors, with runs at the centre.

    No main effect is aliased with another or with a two-factor interaction. Up to three factors it
    is the full factorial, in four runs or more. Raises CalibrationError for another number of
    factors.
    """
    k = len(factors)
    if not 1 <= k <= MAX_SCREENING:
        raise CalibrationError(f"screening takes 1 to {MAX_SCREENING} factors, not {k}")
    import pyDOE3

    matrix = pyDOE3.fracfact(generators(k))[:, :k]
    matrix = np.vstack([matrix, np.zeros((centre_runs, k))])
    return tabulate(matrix, factors, replicates)


def generators(k: int) -> str:
    """Generators of `resolution_iv`, a word a factor: single letters for the base, products of an
    odd number of them for the rest, which is what gives resolution IV."""
    if k in GENERATORS:
        return GENERATORS[k]
    base = max(2, k) if k <= 3 else next(b for b in range(3, 7) if 2 ** (b - 1) >= k)
    letters = "abcdef"[:base]
    odd = ("".join(w) for n in range(3, base + 1, 2) for w in combinations(letters, n))
    return " ".join([*letters, *list(odd)[: max(k - base, 0)]])


def foldover(design: pd.DataFrame, factors: Sequence[CodedFactor]) -> pd.DataFrame:
    """The design (a table) followed by the same runs with all signs changed.

    It parts main effects from two-factor interactions (Box and Wilson 1951, Journal of the Royal
    Statistical Society B 13:1). Runs are numbered on; `fold` is 1 in the runs of the design, 2 in
    the new.
    """
    levels = design[[f.code for f in factors]].to_numpy(float)
    table = tabulate(np.vstack([levels, -levels]), factors)
    return table.assign(fold=np.repeat([1, 2], len(levels)))


def alias_groups(levels: npt.ArrayLike, codes: Sequence[str]) -> list[list[str]]:
    """Two-factor interactions of coded levels (n, factors) that these runs do not part.

    Returns a list of groups of pairs of codes. A pair that is aliased with a main effect, or with
    the mean, stands in the group of that code, or of 'mean'. Pairs of one group differ at most in
    sign and scale once the mean and the main effects are taken off both: a model of main effects
    and one of them fits as well as with another, as in Plackett and Burman's twelve runs.
    """
    x = np.asarray(levels, float)
    found = [("mean", np.ones(len(x)))] + [(c, x[:, i]) for i, c in enumerate(codes)]
    groups = [([name], column) for name, column in found]
    mains = np.column_stack([column for _, column in found])
    for i, j in combinations(range(len(codes)), 2):
        pair, column = (codes[i], codes[j]), x[:, i] * x[:, j]
        own = column - mains @ np.linalg.lstsq(mains, column, rcond=None)[0]
        size = np.linalg.norm(own)
        column = own / size if size > 1e-6 * math.sqrt(len(x)) else column
        for members, other in groups:
            if np.allclose(column, other) or np.allclose(column, -other):
                members.append(pair)
                break
        else:
            groups.append(([pair], column))
    return [members for members, _ in groups if len(members) > 1 or isinstance(members[0], tuple)]
