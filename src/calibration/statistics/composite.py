"""Designs for response surfaces beside Box-Behnken: central composite and D-optimal additions."""

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

STARTS, EXCHANGES = 10, 50


def surface_design(
    factors: Sequence[CodedFactor], centre_runs: int = 5, replicates: int = 1
) -> pd.DataFrame:
    """Box-Behnken for 3 to 7 factors, a face-centred composite design for fewer. Raises
    CalibrationError for more."""
    if len(factors) < 3:
        return central_composite(factors, centre_runs, replicates)
    return box_behnken(factors, centre_runs, replicates)


def region_design(factors: Sequence[CodedFactor], rules: Any) -> pd.DataFrame:
    """The design table that `rules` ask for: the configuration's section `response_surface`.

    The design is that of `surface_design`; `added_runs` are appended. Raises CalibrationError as
    the designs do.
    """
    design = surface_design(factors, rules.centre_runs, rules.replicates)
    if rules.added_runs:
        added = augmented(design, factors, rules.added_runs)
        design = pd.concat([design, added], ignore_index=True)
        design["run"] = np.arange(1, len(design) + 1)
    return design


def central_composite(
    factors: Sequence[CodedFactor], centre_runs: int = 5, replicates: int = 1
) -> pd.DataFrame:
    """Central composite design for 1 to 6 factors: corners, star points on the faces of the region
    and centre, in that order (Box and Hunter 1957, Annals of Mathematical Statistics 28:195).
    Raises CalibrationError for another number of factors.
    """
    k = len(factors)
    if not 1 <= k <= 6:
        raise CalibrationError(f"a central composite design takes 1 to 6 factors, not {k}")
    corners = np.array(list(product((-1.0, 1.0), repeat=k)))
    star = np.vstack([sign * np.eye(k)[i] for i in range(k) for sign in (-1.0, 1.0)])
    return tabulate(np.vstack([corners, star, np.zeros((centre_runs, k))]), factors, replicates)


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
