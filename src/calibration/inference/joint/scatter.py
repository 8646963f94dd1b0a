"""The emulator of a response, fitted to every single run."""

import warnings

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, Matern

from calibration.inference.emulator import _lengths, _Scatter
from calibration.inference.posterior_sampling import ScatterEmulator, _log_variance, replicates

ROUGH_LENGTHS = 0.1, 30.0
"""Bounds of the lengths of the rough part: from the gap between runs to far beyond the region."""
LEAST_ROUGH = 1e-4
"""Variance of the rough part, in that of the response, below which it counts as none."""


class RoughEmulator(ScatterEmulator):
    """A `ScatterEmulator` whose mean may bend sharply or step, with the error that this leaves.

    The process is the smooth one of `calibration.inference.emulator` and a rough one (Matern, nu
    1/2), each with a length an input. Their shares are fitted with the scatter to all single runs.
    Of a smooth response the rough share vanishes; at a step it grows, and so does the error between
    runs. The scatter is not held at what replicates alone say of it: that of a dozen is wrong by a
    fifth, and the errors of the mean would be wrong with it.

    x: (n, d) inputs of single runs in [0, 1]; y: (n,) responses. Raises CalibrationError for too
    few runs, as `ScatterEmulator` does.
    """

    def __init__(self, x: ArrayLike, y: ArrayLike) -> None:
        x, y = np.asarray(x, float), np.asarray(y, float)
        points, of, runs = replicates(x, y)
        residual = y - (np.bincount(of, y) / runs)[of]
        self._log_variance = _log_variance(points, of, residual, runs)
        local = self._variance_of_run(x)
        self._middle, self._spread = float(y.mean()), float(y.std())
        self._x, self._usual = x, float(local.mean())
        self._keep(_fitted(x, (y - self._middle) / self._spread, self._usual / local))

    def _keep(self, process):
        """What predictions need of the fitted process: the kernels' own calls take ten times as
        long at few points, and a sampler makes thousands."""
        whole, scatter = process.kernel_.k1, process.kernel_.k2
        smooth, trend, rough = whole.k1.k1, whole.k1.k2, whole.k2
        self._smooth, self._length = smooth.k1.constant_value, smooth.k2.length_scale
        self._rough, self._short = rough.k1.constant_value, rough.k2.length_scale
        self._linear = trend.k1.constant_value
        self._constant = self._linear * trend.k2.sigma_0**2
        self._same = self._smooth + self._rough + self._constant
        self._level, self._alpha = scatter.noise_level, process.alpha_
        # the inverse's root: its square is the inverse of the runs' covariance
        self._root = solve_triangular(process.L_, np.eye(len(self._x)), lower=True).T

    def mean(self, u: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """(mean, variance of that mean), (k,) each, at u (k, d)."""
        u = np.atleast_2d(np.asarray(u, float))
        cross = self._alike(u)
        known = cross @ self._root
        own = self._same + self._linear * (u * u).sum(axis=1)
        left = np.maximum(own - (known * known).sum(axis=1), 0.0)
        return self._middle + self._spread * (cross @ self._alpha), self._spread**2 * left

    def _alike(self, u):
        """Covariance (k, n) of the response, without the scatter, at u (k, d) and at the runs."""
        smooth = np.exp(-0.5 * cdist(u / self._length, self._x / self._length, "sqeuclidean"))
        rough = np.exp(-cdist(u / self._short, self._x / self._short))
        trend = self._linear * (u @ self._x.T) + self._constant
        return self._smooth * smooth + self._rough * rough + trend

    def scatter(self, u: ArrayLike) -> np.ndarray:
        """Standard deviation (k,) of a single run about the mean at u (k, d)."""
        u = np.atleast_2d(np.asarray(u, float))
        share: np.ndarray = self._variance_of_run(u) / self._usual
        return self._spread * np.sqrt(self._level * share)


def _fitted(x, z, runs):
    """The process of runs z (n,) at inputs x (n, d), each with the weight of `runs` (n,)."""
    lengths = np.full(x.shape[1], 1.5)
    smooth = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(lengths, _lengths(x))
    trend = ConstantKernel(1.0, (1e-4, 1e2)) * DotProduct(1.0, (1e-2, 1e2))
    rough = ConstantKernel(0.1, (LEAST_ROUGH, 10.0)) * Matern(lengths / 3.0, ROUGH_LENGTHS, nu=0.5)
    scatter = _Scatter(0.1, (1e-8, 1.0), runs)
    process = GaussianProcessRegressor(
        smooth + trend + rough + scatter, n_restarts_optimizer=1, random_state=0
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is no fault
        return process.fit(x, z)
