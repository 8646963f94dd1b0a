"""Designs for response surfaces beside Box-Behnken: central composite, D-optimal additions, and
blocks."""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError
from calibration.statistics.design import box_behnken, tabulate
from calibration.statistics.factor import CodedFactor
from calibration.statistics.surface import Term, model_matrix, quadratic_terms
from calibration.statistics.ties import first_largest

FACE, ROTATABLE = "face", "rotatable"
STARTS, EXCHANGES = 10, 50


def surface_design(
    factors: Sequence[CodedFactor], centre_runs: int = 5, replicates: int = 1
) -> pd.DataFrame:
    """Box-Behnken for 3 to 7 factors, a face-centred composite design for fewer. Raises
    CalibrationError for more."""
    if len(factors) < 3:
        return central_composite(factors, centre_runs, FACE, replicates)
    return box_behnken(factors, centre_runs, replicates)


def region_design(factors: Sequence[CodedFactor], rules: Any) -> pd.DataFrame:
    """The design table that `rules` ask for: the configuration's section `response_surface`.

    The design is that of `surface_design`; `added_runs` are appended, and `block_size` gives the
    table a column `block`. Raises CalibrationError as the designs do.
    """
    codes = [f.code for f in factors]
    design = surface_design(factors, rules.centre_runs, rules.replicates)
    if rules.added_runs:
        added = augmented(design, factors, rules.added_runs)
        design = pd.concat([design, added], ignore_index=True)
        design["run"] = np.arange(1, len(design) + 1)
    return blocked(design, rules.block_size, codes) if rules.block_size else design


def central_composite(
    factors: Sequence[CodedFactor],
    centre_runs: int = 5,
    alpha: float | str = FACE,
    replicates: int = 1,
) -> pd.DataFrame:
    """Central composite design for 1 to 6 factors: corners, star points and centre, in that order.

    alpha: coded distance of the star points; `face` puts them on the faces of the region,
    `rotatable` at the fourth root of the number of corners (Box and Hunter 1957, Annals of
    Mathematical Statistics 28:195). Beyond 1 they leave the factors' low and high. Raises
    CalibrationError for another number of factors or a distance that is not above 0.
    """
    k = len(factors)
    if not 1 <= k <= 6:
        raise CalibrationError(f"a central composite design takes 1 to 6 factors, not {k}")
    named: dict[float | str, float] = {FACE: 1.0, ROTATABLE: float(2**k) ** 0.25}
    distance = named.get(alpha, alpha)
    if isinstance(distance, str) or not distance > 0.0:
        raise CalibrationError(
            f"star points at {alpha!r}; allowed: {FACE}, {ROTATABLE}, a number above 0"
        )
    corners = np.array(list(product((-1.0, 1.0), repeat=k)))
    star = np.vstack([sign * distance * np.eye(k)[i] for i in range(k) for sign in (-1.0, 1.0)])
    return tabulate(np.vstack([corners, star, np.zeros((centre_runs, k))]), factors, replicates)


def blocked(
    design: pd.DataFrame,
    size: int,
    codes: Sequence[str],
    terms: Sequence[Term] | None = None,
    seed: int = 1,
) -> pd.DataFrame:
    """The design table with a column `block` of `size` runs each, so that blocks disturb the
    model's terms least.

    Runs are exchanged between blocks as long as this raises the determinant of the terms'
    information beside the blocks. An orthogonal blocking, if there is one, has the largest. Raises
    CalibrationError for a size that does not divide the runs.
    """
    n = len(design)
    if size < 1 or n % size:
        raise CalibrationError(f"{n} runs do not make blocks of {size}")
    x = model_matrix(design[codes].to_numpy(float), codes, terms or quadratic_terms(codes))[:, 1:]
    rng, best = np.random.default_rng(seed), (-np.inf, np.empty(0, int))
    for _ in range(STARTS):
        labels = rng.permutation(np.repeat(np.arange(n // size), size))
        best = max(best, _exchange_labels(x, labels), key=lambda found: found[0])
    return design.assign(block=best[1] + 1)


def _exchange_labels(x, labels):
    value, improved = _within_blocks(x, labels), True
    while improved:
        improved = False
        for i, j in zip(*np.triu_indices(len(labels), 1), strict=True):
            if labels[i] == labels[j]:
                continue
            labels[[i, j]] = labels[[j, i]]
            other = _within_blocks(x, labels)
            if other > value + 1e-9:
                value, improved = other, True
            else:
                labels[[i, j]] = labels[[j, i]]
    return value, labels.copy()


def _within_blocks(x, labels):
    """Log determinant of the information about the terms (n, p) within blocks."""
    centred = np.vstack([x[labels == b] - x[labels == b].mean(0) for b in np.unique(labels)])
    sign, value = np.linalg.slogdet(centred.T @ centred)
    return value if sign > 0 else -np.inf


def augmented(
    design: pd.DataFrame,
    factors: Sequence[CodedFactor],
    runs: int,
    terms: Sequence[Term] | None = None,
    candidates: np.ndarray | None = None,
    seed: int = 1,
) -> pd.DataFrame:
    """`runs` new runs that make the whole most informative about the model: the largest determinant
    of X' X.

    design: the table of runs there are. candidates: (m, factors) coded points to choose from, the
    grid of three levels unless given. Points are exchanged one by one (Fedorov 1972, Theory of
    Optimal Experiments) from several random starts. Returns the table of the new runs alone. Raises
    CalibrationError where the model stays undetermined.
    """
    codes = [f.code for f in factors]
    terms = terms or quadratic_terms(codes)
    if candidates is None:
        candidates = np.array(list(product((-1.0, 0.0, 1.0), repeat=len(codes))))
    candidates = np.asarray(candidates, float)
    old = model_matrix(design[codes].to_numpy(float), codes, terms)
    new = model_matrix(candidates, codes, terms)
    rng, best = np.random.default_rng(seed), (-np.inf, np.empty(0, int))
    for _ in range(STARTS):
        chosen = rng.integers(len(candidates), size=runs)
        found = _exchange_points(old, new, chosen)
        best = found if found[0] > best[0] + 1e-9 else best  # the first of equally good ones
    if not np.isfinite(best[0]):
        raise CalibrationError(
            f"{len(design)} runs and {runs} more leave a model of {len(terms)} terms undetermined"
        )
    return tabulate(candidates[np.sort(best[1])], factors)


def _exchange_points(old, new, chosen):
    # a ridge far below any run's information lets the search begin from too few runs
    floor = 1e-9 * np.eye(old.shape[1])
    for _ in range(EXCHANGES):
        before = chosen.copy()
        for i in range(len(chosen)):
            kept = np.delete(chosen, i)
            rest = old.T @ old + new[kept].T @ new[kept] + floor
            gained = np.einsum("ij,jk,ik->i", new, np.linalg.inv(rest), new)
            chosen[i] = first_largest(gained)
        if np.array_equal(before, chosen):
            break
    information = old.T @ old + new[chosen].T @ new[chosen]
    if np.linalg.matrix_rank(information) < len(information):
        return -np.inf, chosen
    return float(np.linalg.slogdet(information)[1]), chosen
