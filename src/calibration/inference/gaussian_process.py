"""The Gaussian process of a response over coded inputs, trained by runs."""

import warnings
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import (
    RBF,
    ConstantKernel,
    DotProduct,
    Matern,
    Sum,
    WhiteKernel,
)

from calibration.errors import CalibrationError

LEAST_LENGTH, MOST_LENGTH = 0.15, 30.0  # of the inputs' range
LEAST_ROUGH_LENGTH = 0.1
"""Length of the rough part from which on it can bend, of the inputs' range."""
LEAST_ROUGH = 1e-4
"""Variance of the rough part, in that of the response, below which it counts as none."""


Known = tuple[Sequence[float], float, float]
"""Logarithms of the kernel's constants, and the middle and the spread of the responses."""


class GaussianProcess:
    """A response over x in [0, 1]^d that scatters from run to run.

    The process has a smooth part (squared exponential, a length an input), a linear trend, and a
    part that may bend sharply or step (Matern, nu 1/2): of a smooth response its share vanishes, at
    a step it grows, and so does the error between runs. Shares, lengths and the scatter are fitted
    together, by maximum likelihood.
    """

    def __init__(self, before: Any = None) -> None:
        """before: an emulator that this one corrects, by what responses differ from its mean. Few
        runs are enough, as this difference bends less than the response (Kennedy and O'Hagan 2000,
        Biometrika 87:1); the error of `before` is in it, and counts there."""
        self.before = before

    def _expected(self, x):
        """What is expected before any response is seen."""
        return self.before.mean(x)[0] if self.before else 0.0

    def fit(self, x: ArrayLike, y: ArrayLike, known: Known | None = None) -> Self:
        """Train by responses y (n,) of single runs at inputs x (n, d) in [0, 1]. Returns the
        process. known: `known` of a process that was trained by more runs of the response, whose
        shares, lengths and scatter are taken as they are.

        How the scatter varies replicates tell, where they stand at several points: the log variance
        within points is linear in x (gamma regression: Harvey 1976, Econometrica 44:461). The
        scatter itself is not held at what replicates alone say of it: that of a dozen is wrong by a
        fifth, and the errors of the mean would be wrong with it. Raises CalibrationError for runs
        that are too few, or all alike.
        """
        self.x, y = np.asarray(x, float), np.asarray(y, float) - self._expected(x)
        self._log_variance = _log_variance(self.x, y)
        local = self._variance_of_run(self.x)
        self._usual = float(local.mean())
        self.middle, self.spread = float(y.mean()), float(y.std()) or 1.0
        kernel = _kernel(self.x, self._usual / local)
        search: dict[str, Any] = {"n_restarts_optimizer": 1}
        if known:
            kernel, search = kernel.clone_with_theta(known[0]), {"optimizer": None}
            self.middle, self.spread = known[1:]
        process = GaussianProcessRegressor(kernel, random_state=0, **search)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is no fault
            process.fit(self.x, (y - self.middle) / self.spread)
        self._keep(process)
        self.known: Known = [float(t) for t in process.kernel_.theta], self.middle, self.spread
        return self

    def _keep(self, process):
        """Return what predictions need of the fitted process: the kernels' own calls take ten times
        as long at few points, and a sampler makes thousands."""
        smooth, trend, rough, scatter = _summands(process.kernel_)
        self._linear = trend.k1.constant_value
        self._offset = self._linear * trend.k2.sigma_0**2
        parts = [smooth, rough]
        self._variances = np.array([p.k1.constant_value for p in parts])
        d = self.x.shape[1]
        self._lengths = np.array([np.broadcast_to(p.k2.length_scale, d) for p in parts])
        self.noise, self.alpha = scatter.noise_level, process.alpha_
        # the inverse's root: its square is the inverse of the runs' covariance
        self._root = solve_triangular(process.L_, np.eye(len(self.x)), lower=True).T

    def mean(self, x: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """(mean, variance of that mean), (k,) each, at x (k, d)."""
        x = np.atleast_2d(np.asarray(x, float))
        cross = self._covariance(x, self.x)
        known = cross @ self._root
        own = self._variances.sum() + self._offset + self._linear * (x**2).sum(axis=1)
        left = np.maximum(own - (known * known).sum(axis=1), 0.0)
        expected = self.middle + self.spread * (cross @ self.alpha)
        return self._expected(x) + expected, self.spread**2 * left

    def sd_of_run(self, x: ArrayLike) -> np.ndarray:
        """Standard deviation (k,) of a single run about the mean at x (k, d)."""
        x = np.atleast_2d(np.asarray(x, float))
        share: np.ndarray = self._variance_of_run(x) / self._usual
        return self.spread * np.sqrt(self.noise * share)

    def left_out(self) -> tuple[np.ndarray, np.ndarray]:
        """(error, its standard deviation), (n,) each: what the other runs expect of each, less it,
        with the same lengths (Rasmussen and Williams 2006, 5.4.2)."""
        own = (self._root**2).sum(axis=1)  # diagonal of the inverse covariance
        return -self.spread * self.alpha / own, self.spread / np.sqrt(own)

    def _variance_of_run(self, x):
        return np.exp(self._log_variance[0] + x @ self._log_variance[1:])

    def _covariance(self, x, y):
        """Prior covariance (k, m) of the responses, without scatter, at (k, d) and (m, d)."""
        (smooth, rough), (near, far) = self._variances, self._lengths
        bent = rough * np.exp(-cdist(x / far, y / far, "euclidean"))
        even = smooth * np.exp(-0.5 * cdist(x / near, y / near, "sqeuclidean"))
        return even + bent + (self._linear * (x @ y.T) + self._offset)


class _Scatter(WhiteKernel):
    """Noise of means (n,): that of one run over the number of runs (n,) behind each."""

    def __init__(self, noise_level, noise_level_bounds, runs):
        super().__init__(noise_level, noise_level_bounds)
        self.runs = runs

    def __call__(self, X, Y=None, eval_gradient=False):
        if Y is not None:
            return super().__call__(X, Y)
        noise = np.diag(self.noise_level / self.runs)
        if not eval_gradient:
            return noise
        return noise, noise[:, :, None]


def _lengths(x, least=LEAST_LENGTH):
    """Bounds (d, 2) of the lengths that inputs x (n, d) can tell, `least` at least.

    With a length far below the widest gap between levels the process would forget within it what
    the levels say, and a design of three levels would fit as well. So the gap is the least length.
    """
    gaps = [np.diff(np.unique(column)).max(initial=0.0) for column in x.T]
    return np.array([(max(least, gap), MOST_LENGTH) for gap in gaps])


def _kernel(x, weights):
    """Kernel of responses at inputs x (n, d) with weights (n,): smooth, trend, rough, scatter."""
    lengths = np.full(x.shape[1], 1.5)
    kernel = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(lengths, _lengths(x))
    kernel += ConstantKernel(1.0, (1e-4, 1e2)) * DotProduct(1.0, (1e-2, 1e2))
    bent = Matern(lengths / 3.0, _lengths(x, LEAST_ROUGH_LENGTH), nu=0.5)
    kernel += ConstantKernel(0.1, (LEAST_ROUGH, 10.0)) * bent
    return kernel + _Scatter(0.1, (1e-8, 1.0), weights)


def _summands(kernel):
    return [*_summands(kernel.k1), kernel.k2] if isinstance(kernel, Sum) else [kernel]


def _log_variance(x, y):
    """Coefficients (1 + d,) of the logarithm of the variance of single runs y (n,) about the mean
    of their point; zero, for as much everywhere, where fewer than twice as many points are
    repeated."""
    n, d = x.shape
    if n < d + 3 or np.ptp(y) == 0.0:
        raise CalibrationError(
            f"{n} runs do not tell a response over {d} factors: at least {d + 3} are needed, whose "
            "responses differ"
        )
    points, of = np.unique(np.round(x, 9), axis=0, return_inverse=True)
    of, runs = of.ravel(), np.bincount(of.ravel())
    repeated, residual = runs > 1, y - (np.bincount(of, y) / runs)[of]
    freedom, squares = runs[repeated] - 1, np.bincount(of, residual**2)[repeated]
    if repeated.sum() < 2 * (d + 1) or squares.sum() == 0.0:
        return np.zeros(1 + d)
    start = np.append(np.log(squares.sum() / freedom.sum()), np.zeros(d))
    return _gamma_regression(points[repeated], squares / freedom, freedom, start)


def _gamma_regression(x, variance, freedom, start):
    """Fisher scoring of log variance = b0 + b x from variances (n,) on `freedom` degrees; slopes
    are shrunk by a unit normal prior, so that few replicates do not make a variance model of
    chance."""
    matrix = np.column_stack([np.ones(len(x)), x])
    prior = np.eye(matrix.shape[1])
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
