"""A Gaussian process of a response over coded inputs, trained by runs, with its own error by
leave-one-out."""

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

LEAST_LENGTH, MOST_LENGTH = 0.15, 30.0  # of the inputs' range


class Emulator:
    """z(x) for x in [0, 1]^d, from means z (n,) of `runs` (n,) at inputs x (n, d); one run at each
    unless given.

    `error` is the leave-one-out root mean square error in z, hyperparameters held, of the first
    `judged` means (all unless given); `spread` is the sd of z over the design. `scatter` is the sd
    of z from seed to seed, which is part of that error but not of the emulator's mean, where
    `scatters`; else what looks like noise counts as a wrong mean.
    """

    def __init__(
        self,
        x: ArrayLike,
        z: ArrayLike,
        judged: int | None = None,
        scatters: bool = False,
        runs: ArrayLike | None = None,
    ) -> None:
        x, z = np.asarray(x, float), np.asarray(z, float)
        runs = np.ones(len(z)) if runs is None else np.asarray(runs, float)
        self.mean, self.spread = float(z.mean()), float(z.std()) or 1.0
        process = _process(x, (z - self.mean) / self.spread, runs)
        self.x, self.alpha = x, process.alpha_
        smooth = process.kernel_.k1
        self.scale = smooth.k1.k1.constant_value
        self.length = np.atleast_1d(smooth.k1.k2.length_scale)  # of one input a plain number
        self.linear, self.offset = smooth.k2.k1.constant_value, smooth.k2.k2.sigma_0**2
        self._inverse = np.linalg.inv(process.kernel_(x))
        left_out = self.alpha / np.diag(self._inverse)
        self._misses = (self.spread * left_out) ** 2
        self.error = float(np.sqrt(np.mean(self._misses[:judged])))
        scatter = process.kernel_.k2.noise_level if scatters else 0.0
        self._nugget = scatter / runs.mean()
        self.scatter = self.spread * float(np.sqrt(scatter))
        self.runs = int(runs.sum())
        self._slope = self.linear * (self.x.T @ self.alpha)
        self._constant = self.linear * self.offset * float(self.alpha.sum())

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """(k,) transformed responses at (k, d) inputs."""
        return self.with_slope(x, [])[0]

    def with_slope(
        self, x: np.ndarray, columns: Sequence[int], error: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Responses (k,), their derivatives (k, c) by the inputs in `columns`, and where `error`
        their variances (k,).

        The variance is the mean squared leave-one-out error of the runs nearby, weighted by their
        distance in the process' lengths, together with that of all runs at the weight of one; of it
        the share that is not scatter.
        """
        like = self._alike(x, self.x)
        # the derivative of a squared exponential is a difference of the same sums, weighted by the
        # runs' inputs
        weights = self.scale * np.column_stack(
            [self.alpha, self.alpha[:, None] * self.x[:, columns]]
        )
        sums = like @ weights
        value = sums[:, 0] + x @ self._slope + self._constant
        slope = (sums[:, 1:] - x[:, columns] * sums[:, :1]) / self.length[columns] ** 2
        variance = self._variance(x, like) if error else None
        return (
            self.mean + self.spread * value,
            self.spread * (slope + self._slope[columns]),
            variance,
        )

    def _variance(self, x, like):
        near = like**4  # half the process' lengths
        variance = (near @ self._misses + self.error**2) / (near.sum(1) + 1.0)
        return variance * self._share_of_mean(x, like) if self._nugget else variance

    def correlation(self, x: np.ndarray) -> np.ndarray:
        """Correlation (k, k) of the errors at k inputs: of the process given its runs, for it is
        wrong smoothly."""
        cross = self._covariance(x, self.x, self._alike(x, self.x))
        own = self._covariance(x, x, self._alike(x, x))
        left = own - cross @ self._inverse @ cross.T
        # next to a run nothing is left but rounding, which is alike nowhere
        rounding = 1e-6 * np.diag(own).max()
        size = np.sqrt(np.maximum(np.diag(left), 0.0) + rounding)
        out = np.clip(left / np.outer(size, size), -1.0, 1.0)
        np.fill_diagonal(out, 1.0)
        return out

    def _alike(self, x, y):
        """Squared exponential (k, m) of the distances between (k, d) and (m, d) inputs, 1 where
        they are the same."""
        a, b = x / self.length, y / self.length
        square = (a * a).sum(1)[:, None] + (b * b).sum(1) - 2.0 * a @ b.T
        return np.exp(-0.5 * square)

    def _covariance(self, x, y, like):
        """Prior covariance (k, m) of the responses at (k, d) and (m, d) inputs that are `like` each
        other."""
        return self.scale * like + self.linear * (x @ y.T + self.offset)

    def _share_of_mean(self, x, like):
        """Variance of the process' mean (k,) over that of a run there."""
        cross = self._covariance(x, self.x, like)
        own = self.scale + self.linear * ((x * x).sum(1) + self.offset)
        mean = np.maximum(own - ((cross @ self._inverse) * cross).sum(1), 0.0)
        return mean / (mean + self._nugget)


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


def _process(x, z, runs):
    """The fitted Gaussian process: squared exponential with a length an input, a linear trend,
    noise."""
    d = x.shape[1]
    kernel = (
        ConstantKernel(1.0, (1e-3, 1e3)) * RBF(np.full(d, 1.5), _lengths(x))
        + ConstantKernel(1.0, (1e-4, 1e2)) * DotProduct(1.0, (1e-2, 1e2))
        + _Scatter(1e-3, (1e-8, 1.0), runs)
    )
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=1, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is no fault
        return process.fit(x, z)
