"""The fit of a Gaussian process: a squared exponential with a length an input, a linear trend, and
noise.

The kernel is c exp(-|x - y|^2 / 2 l^2) + t (x y + o^2) + s / runs. Its numbers are those of the
greatest marginal likelihood (Rasmussen and Williams 2006, Gaussian Processes for Machine Learning,
equations 5.8 and 5.9). The search begins at one fixed point and at one drawn over the bounds.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_solve, cholesky
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

SCALE, LENGTH, LINEAR, OFFSET = (1e-3, 1e3), (0.15, 30.0), (1e-4, 1e2), (1e-2, 1e2)
NOISE = (1e-8, 1.0)
"""Bounds of c, l, t, o and s, inputs in 0..1 and responses of variance 1."""
START = 1.0, 1.5, 1.0, 1.0, 1e-3
"""Where the search for c, l, t, o and s begins."""
JITTER = 1e-10
"""On the diagonal while the likelihood is computed, against rounding."""


@dataclass(frozen=True)
class Process:
    """A fitted process: `scale` c, `length` l (d,), `linear` t, `offset` o^2, `noise` s;
    `covariance` (n, n) of the means with their noise, `alpha` (n,) its inverse times the means."""

    scale: float
    length: np.ndarray
    linear: float
    offset: float
    noise: float
    covariance: np.ndarray
    alpha: np.ndarray


def fit_process(x, z, runs, noise=None):
    """The `Process` of means z (n,) of `runs` (n,) at inputs x (n, d); `noise` s is found too
    unless given."""
    likelihood = _Likelihood(np.asarray(x, float), np.asarray(z, float), runs, noise)
    theta = likelihood.greatest()
    scale, length, linear, offset, level = likelihood.named(theta)
    covariance = likelihood.covariance(theta)[0]
    jittered = covariance + JITTER * np.eye(len(covariance))
    alpha = cho_solve((cholesky(jittered, lower=True), True), likelihood.z)
    return Process(scale, length, linear, offset**2, level, covariance, alpha)


class _Likelihood:
    """Marginal likelihood of the logarithms theta of c, l (d,), t, o, and of s where it is free."""

    def __init__(self, x, z, runs, noise):
        self.x, self.z, self.runs, self.noise = x, z, np.asarray(runs, float), noise
        d = x.shape[1]
        free = [SCALE, *[LENGTH] * d, LINEAR, OFFSET] + ([NOISE] if noise is None else [])
        start = [START[0], *[START[1]] * d, *START[2:]][: len(free)]
        self.bounds, self.start = np.log(free), np.log(start)

    def named(self, theta):
        """c, l (d,), t, o, s."""
        d, values = self.x.shape[1], np.exp(theta)
        level = values[-1] if self.noise is None else self.noise
        return values[0], values[1 : d + 1], values[d + 1], values[d + 2], level

    def covariance(self, theta):
        """Covariance (n, n) of the means, and its derivatives (n, n, k) by theta."""
        x = self.x
        scale, length, linear, offset, level = self.named(theta)
        smooth = scale * np.exp(-0.5 * cdist(x / length, x / length, "sqeuclidean"))
        trend = linear * (x @ x.T + offset**2)
        noise = np.diag(level / self.runs)
        apart = (x[:, None, :] - x[None, :, :]) ** 2 / length**2
        slopes = [
            smooth[..., None],
            smooth[..., None] * apart,
            trend[..., None],
            np.full((*smooth.shape, 1), 2.0 * linear * offset**2),
        ]
        slopes += [noise[..., None]] if self.noise is None else []
        return smooth + trend + noise, np.concatenate(slopes, axis=2)

    def __call__(self, theta):
        """Minus the log likelihood, and its derivatives (k,)."""
        covariance, slopes = self.covariance(theta)
        covariance[np.diag_indices_from(covariance)] += JITTER
        try:
            root = cholesky(covariance, lower=True)
        except LinAlgError:
            return np.inf, np.zeros_like(theta)
        alpha = cho_solve((root, True), self.z)
        value = -0.5 * self.z @ alpha - np.log(np.diag(root)).sum()
        value -= 0.5 * len(self.z) * np.log(2.0 * np.pi)
        inner = np.outer(alpha, alpha) - cho_solve((root, True), np.eye(len(self.z)))
        return -value, -0.5 * np.einsum("ij,ijk->k", inner, slopes)

    def greatest(self):
        """Theta (k,) of the greatest likelihood."""
        drawn = np.random.RandomState(0).uniform(*self.bounds.T)
        found = [
            minimize(self, start, jac=True, method="L-BFGS-B", bounds=self.bounds)
            for start in (self.start, drawn)
        ]
        return min(found, key=lambda f: f.fun).x
