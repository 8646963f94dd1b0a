"""How likely a test ends without a value: a logistic regression over inputs in [0, 1]^d, trained by
the runs that gave one and by those that did not.

Weights have normal priors; their size is the one of `SIZES` with the largest evidence (Laplace's
approximation). What is not known of the weights draws the probability towards one half: MacKay
(1992), Neural Computation 4:720.
"""

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike
from scipy.special import expit

SIZES = (1.0, 3.0, 9.0, 27.0)
"""Prior standard deviations of the weights that are tried: change of the logarithm of the odds over
the range of an input."""

USUAL = 5.0  # prior standard deviation of the logarithm of the odds in the middle
STEPS = 50


class Chance:
    """Logarithm of the odds of no value at x (k, d) in [0, 1]^d, from runs at x (n, d) of which
    `failed` (n,) of `runs` (n,) gave none."""

    def __init__(self, x: ArrayLike, failed: ArrayLike, runs: ArrayLike) -> None:
        x = _with_one(np.asarray(x, float))
        failed, runs = np.asarray(failed, float), np.asarray(runs, float)
        tried = [_laplace(x, failed, runs, size) for size in SIZES]
        self.weights, self.covariance, self.evidence = max(tried, key=lambda t: t[2])
        self.failed, self.runs = int(failed.sum()), int(runs.sum())

    def predict(self, x: np.ndarray, error: bool = False) -> tuple[np.ndarray, None]:
        """Logarithms of the odds (k,) at x (k, d). None in the place of a variance, whether `error`
        asks for it or not, as the odds have it already."""
        x = _with_one(x)
        variance = ((x @ self.covariance) * x).sum(1)
        return x @ self.weights / np.sqrt(1.0 + np.pi * variance / 8.0), None


def _with_one(x):
    return np.column_stack([x - 0.5, np.ones(len(x))])


def _laplace(x, failed, runs, size):
    """Mode (d + 1,), covariance and log evidence of the weights under a prior size."""
    prior = np.append(np.full(x.shape[1] - 1, size), USUAL) ** -2.0
    weights = np.zeros(x.shape[1])
    for _ in range(STEPS):
        gradient, hessian = _derivatives(x, failed, runs, weights, prior)
        move = np.linalg.solve(hessian, gradient)
        weights = weights + move * min(1.0, 5.0 / max(np.abs(move).max(), 1e-12))
        if np.abs(move).max() < 1e-9:
            break
    _, hessian = _derivatives(x, failed, runs, weights, prior)
    likelihood = log_likelihood(x @ weights, failed, runs).sum()
    shape = 0.5 * (np.log(prior).sum() - np.linalg.slogdet(hessian)[1])
    return weights, np.linalg.inv(hessian), likelihood - 0.5 * prior @ weights**2 + shape


def _derivatives(x, failed, runs, weights, prior):
    chance = expit(x @ weights)
    gradient = x.T @ (failed - runs * chance) - prior * weights
    curvature = (runs * chance * (1.0 - chance))[:, None] * x
    return gradient, x.T @ curvature + np.diag(prior)


def log_likelihood(odds: np.ndarray, failed: npt.ArrayLike, tests: npt.ArrayLike) -> np.ndarray:
    """Log probability of `failed` of `tests`, all of one shape, at logarithms of the odds, without
    the binomial coefficient."""
    return failed * odds - tests * np.logaddexp(0.0, odds)
