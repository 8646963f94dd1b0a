"""The emulator of a response that scatters from seed to seed, fitted to every single run."""

import warnings

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, Matern

from calibration.errors import CalibrationError
from calibration.inference.emulator import _lengths, _Scatter

LEAST_ROUGH_LENGTH = 0.1
"""Length of the rough part from which on it can bend, of the inputs' range."""
LEAST_ROUGH = 1e-4
"""Variance of the rough part, in that of the response, below which it counts as none."""


def replicates(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(points (m, d), number of each run's point (n,), number of runs at each point (m,)) of single
    runs at inputs x (n, d) in [0, 1] with responses y (n,). Raises CalibrationError for runs that
    are too few to emulate a response, or all alike."""
    least = x.shape[1] + 3
    if len(y) < least or np.ptp(y) == 0.0:
        raise CalibrationError(
            f"{len(y)} runs do not tell a response over {x.shape[1]} factors: at least {least} are "
            "needed, whose responses differ"
        )
    points, of = np.unique(np.round(x, 9), axis=0, return_inverse=True)
    return points, of.ravel(), np.bincount(of.ravel())


class ScatterEmulator:
    """Emulated mean of a response over u in [0, 1]^d, which may bend sharply or step, and its
    scatter from seed to seed, which may vary with u.

    The process is the smooth one of `calibration.inference.emulator` and a rough one (Matern, nu
    1/2), each with a length an input. Their shares are fitted with the scatter to all single runs.
    Of a smooth response the rough share vanishes; at a step it grows, and so does the error between
    runs. The scatter is not held at what replicates alone say of it: that of a dozen is wrong by a
    fifth, and the errors of the mean would be wrong with it. How it varies replicates tell, where
    they stand at several points: the log variance within points is linear in u (gamma regression:
    Harvey 1976, Econometrica 44:461).

    x: (n, d) inputs of single runs in [0, 1]; y: (n,) responses. Raises CalibrationError for too
    few runs.
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

    def _variance_of_run(self, u):
        if self._log_variance is None:
            return np.ones(len(u))
        return np.exp(self._log_variance[0] + u @ self._log_variance[1:])


def _fitted(x, z, runs):
    """The process of runs z (n,) at inputs x (n, d), each with the weight of `runs` (n,)."""
    lengths = np.full(x.shape[1], 1.5)
    smooth = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(lengths, _lengths(x))
    trend = ConstantKernel(1.0, (1e-4, 1e2)) * DotProduct(1.0, (1e-2, 1e2))
    bounds = _lengths(x, LEAST_ROUGH_LENGTH)
    rough = ConstantKernel(0.1, (LEAST_ROUGH, 10.0)) * Matern(lengths / 3.0, bounds, nu=0.5)
    scatter = _Scatter(0.1, (1e-8, 1.0), runs)
    process = GaussianProcessRegressor(
        smooth + trend + rough + scatter, n_restarts_optimizer=1, random_state=0
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is no fault
        return process.fit(x, z)


def _log_variance(points, of, residual, runs):
    """Coefficients (1 + d,) of the log variance, or None where fewer than twice as many points are
    repeated."""
    repeated = runs > 1
    d = points.shape[1]
    if repeated.sum() == 0:
        return None
    squares = np.bincount(of, residual**2)[repeated]
    freedom = runs[repeated] - 1
    pooled = squares.sum() / freedom.sum()
    if pooled <= 0.0:
        return None
    constant = np.concatenate([[np.log(pooled)], np.zeros(d)])
    if repeated.sum() < 2 * (d + 1):
        return constant
    return _gamma_regression(points[repeated], squares / freedom, freedom, constant)


def _gamma_regression(x, variance, freedom, start, penalty=1.0):
    """Fisher scoring of log variance = b0 + b x from variances (n,) on `freedom` degrees; slopes
    are shrunk by a unit normal prior, so that few replicates do not make a variance model of
    chance."""
    matrix = np.column_stack([np.ones(len(x)), x])
    prior = penalty * np.eye(matrix.shape[1])
    prior[0, 0] = 0.0
    beta = start
    for _ in range(50):
        ratio = variance / np.exp(matrix @ beta)
        score = matrix.T @ (0.5 * freedom * (ratio - 1.0)) - prior @ beta
        step = np.linalg.solve(matrix.T @ (0.5 * freedom[:, None] * matrix) + prior, score)
        beta = beta + np.clip(step, -1.0, 1.0)
        if np.abs(step).max() < 1e-8:
            break
    return beta
