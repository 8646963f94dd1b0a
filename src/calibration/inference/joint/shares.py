"""Which parameter a prediction's spread comes from, when the parameters hang together."""

import numpy as np
from numpy.typing import ArrayLike
from sklearn.linear_model import LinearRegression

from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.joint.critique import thinned

TERMS = 3
"""Degree of the polynomial in one parameter by which the mean given this parameter is found."""


def shares(predicted: ArrayLike, draws: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """(first (d,), alone (d,)) shares of the variance of `predicted` (k,) over draws u (k, d).

    first: share that goes if the parameter became known, whatever hangs together with it (first
    Sobol index of dependent inputs); alone: share that no other parameter explains (total index):
    Kucherenko, Tarantola, Annoni 2012, Computer Physics Communications 183:937. Both by regression
    on polynomials of the draws. Shares of dependent parameters do not add up to 1.
    """
    y, u = np.asarray(predicted, float), np.asarray(draws, float)
    d, whole = u.shape[1], np.asarray(predicted, float).var()
    if whole == 0.0:
        return np.zeros(d), np.zeros(d)
    powers = [_powers(u[:, [k]]) for k in range(d)]
    every = _explained(np.hstack([*powers, _products(u)]), y)
    first = np.array([_explained(p, y) for p in powers])
    alone = np.empty(d)
    for k in range(d):
        rest = [j for j in range(d) if j != k]
        columns = [powers[j] for j in rest] + ([_products(u[:, rest])] if len(rest) > 1 else [])
        alone[k] = every - (_explained(np.hstack(columns), y) if columns else 0.0)
    return np.clip(first, 0.0, 1.0), np.clip(alone, 0.0, 1.0)


def _powers(x):
    z = (x - x.mean()) / (x.std() or 1.0)
    return np.hstack([z**p for p in range(1, TERMS + 1)])


def _products(u):
    z = (u - u.mean(axis=0)) / np.where(u.std(axis=0) > 0.0, u.std(axis=0), 1.0)
    i, j = np.triu_indices(u.shape[1], 1)
    return z[:, i] * z[:, j]


def _explained(terms, y):
    """Share of the variance of y (k,) that a regression on terms (k, t) explains, corrected for
    their number."""
    k, t = terms.shape
    share = LinearRegression().fit(terms, y).score(terms, y)
    return 1.0 - (1.0 - share) * (k - 1) / max(k - t - 1, 1)


def pushed(
    emulator: GaussianProcess, draws: np.ndarray, seed: int = 1
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(u (k, d), means (k,), single runs (k,)) that draws expect, the emulator's error in both and
    the seeds' scatter in the second."""
    u, rng = thinned(draws), np.random.default_rng(seed)
    mean, variance = emulator.mean(u)
    many = rng.normal(mean, np.sqrt(variance))
    return u, many, rng.normal(many, emulator.sd_of_run(u))
