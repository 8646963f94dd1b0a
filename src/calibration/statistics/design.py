"""Designs of experiments as tidy tables: a row a run, coded and natural levels side by side.

Columns: `run` (1...), `replicate`, one column a factor code with the coded level, one a factor name
with the natural level.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import scipy

from calibration.errors import CalibrationError
from calibration.statistics.factor import Factor

TRIPLES = {
    6: ("124", "235", "346", "145", "256", "136"),
    7: ("456", "167", "257", "124", "347", "135", "236"),
}
"""Factors that leave the centre together (Box and Behnken 1960, Technometrics 2:455). pyDOE3 pairs
them instead and takes 60 and 84 runs; the published designs take 48 and 56."""


def box_behnken(
    factors: Sequence[Factor], centre_runs: int = 5, replicates: int = 1
) -> pd.DataFrame:
    """Box-Behnken design for 3 to 7 factors. Raises CalibrationError for another number."""
    k = len(factors)
    if not 3 <= k <= 7:
        raise CalibrationError(f"a Box-Behnken design takes 3 to 7 factors, not {k}")
    if k in TRIPLES:
        matrix = _from_blocks(TRIPLES[k], k, centre_runs)
    else:
        import pyDOE3

        matrix = np.asarray(pyDOE3.bbdesign(k, center=centre_runs), float)
    return tabulate(matrix, factors, replicates)


def _from_blocks(blocks, k, centre_runs):
    rows = []
    for block in blocks:
        for signs in product((-1.0, 1.0), repeat=len(block)):
            row = np.zeros(k)
            row[[int(c) - 1 for c in block]] = signs
            rows.append(row)
    return np.vstack([rows, np.zeros((centre_runs, k))])


def region_design(factors: Sequence[Factor], rules: Any) -> pd.DataFrame:
    """The design table that `rules` ask for, the configuration's section `response_surface`:
    Box-Behnken for 3 to 7 factors, a face-centred composite design for fewer. Raises
    CalibrationError for more."""
    design = central_composite if len(factors) < 3 else box_behnken
    return design(factors, rules.centre_runs, rules.replicates)


def central_composite(
    factors: Sequence[Factor], centre_runs: int = 5, replicates: int = 1
) -> pd.DataFrame:
    """Central composite design: corners, star points on the faces of the region and centre, in that
    order (Box and Hunter 1957, Annals of Mathematical Statistics 28:195)."""
    k = len(factors)
    corners = np.array(list(product((-1.0, 1.0), repeat=k)))
    star = np.vstack([sign * np.eye(k)[i] for i in range(k) for sign in (-1.0, 1.0)])
    return tabulate(np.vstack([corners, star, np.zeros((centre_runs, k))]), factors, replicates)


def steepest_path(
    factors: Sequence[Factor],
    start: Mapping[str, float],
    step: Mapping[str, float],
    steps: int,
    replicates: int = 1,
) -> pd.DataFrame:
    """`steps` points start + k step in natural levels, the whole path repeated `replicates` times;
    start, step: {factor name: value}. Levels outside a factor's range, and factors without start or
    step, raise CalibrationError."""
    for name in (f.name for f in factors):
        if name not in start or name not in step:
            raise CalibrationError(
                f"the path has no {'step' if name in start else 'start'} for {name}"
            )
    rows = []
    for r, k in product(range(replicates), range(steps)):
        row: dict[str, Any] = {"run": len(rows) + 1, "replicate": r + 1}
        for f in factors:
            value = round(start[f.name] + k * step[f.name], 9)
            if not f.low - 1e-9 <= value <= f.high + 1e-9:
                raise CalibrationError(
                    f"step {k + 1} of the ascent takes {f.name} to {value:g}, outside {f.low:g} to "
                    f"{f.high:g}"
                )
            row[f.code], row[f.name] = f.coded(value), value
        rows.append(row)
    return pd.DataFrame(rows)


def path_from_effects(
    factors: Sequence[Factor], effects: Mapping[str, float], steps: int
) -> tuple[dict[str, float], dict[str, float]]:
    """Start and step, {factor name: value} each, of a path from the low-response corner to the
    high-response one.

    Each factor moves in the direction of its effect, from the end of its range where the response
    is low, by steps in proportion to its effect. The factor with the largest effect crosses its
    whole range. steps: two or more. Raises CalibrationError when no factor has an effect.
    """
    largest = max(abs(effects[f.code]) for f in factors)
    if largest == 0.0:
        raise CalibrationError("no factor has an effect; there is no way up")
    start, step = {}, {}
    for f in factors:
        share = effects[f.code] / largest
        step[f.name] = 2.0 * f.half_range * share / (steps - 1)
        start[f.name] = f.centre - 0.5 * (steps - 1) * step[f.name]
    return start, step


def tabulate(matrix: np.ndarray, factors: Sequence[Factor], replicates: int = 1) -> pd.DataFrame:
    """Design table of a coded matrix (runs, factors), the whole design repeated `replicates`
    times."""
    rows: list[dict[str, Any]] = []
    for r in range(replicates):
        for levels in matrix:
            row: dict[str, Any] = {"run": len(rows) + 1, "replicate": r + 1}
            row |= {f.code: float(x) for f, x in zip(factors, levels, strict=True)}
            row |= {f.name: f.natural(float(x)) for f, x in zip(factors, levels, strict=True)}
            rows.append(row)
    return pd.DataFrame(rows)


def space_filling(count: int, d: int, seed: int) -> np.ndarray:
    """Points (count, d) in [0, 1]^d, the first of a scrambled Sobol sequence (Owen 1998, Journal of
    Complexity 14:466)."""
    doublings = max(int(np.ceil(np.log2(count))), 1)
    points: np.ndarray = scipy.stats.qmc.Sobol(d, seed=seed).random_base2(doublings)
    return points[:count]
