"""A Gaussian process whose error is that of runs that are left out."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from calibration.inference.gaussian_process import GaussianProcess


class Emulator(GaussianProcess):
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
        super().__init__(rough=False)
        behind = np.ones(len(np.asarray(z))) if runs is None else np.asarray(runs, float)
        self.fit(x, z, behind)
        self._leave_out(slice(judged))
        scatter = self.noise if scatters else 0.0
        self._nugget = scatter / behind.mean()
        self.scatter = self.spread * float(np.sqrt(scatter))
        self.runs = int(behind.sum())

    def _leave_out(self, judged):
        """Squared errors of all runs, each left out, and the error of those that are judged."""
        self._misses = (self.spread * self.alpha / (self._root**2).sum(axis=1)) ** 2
        self.error = float(np.sqrt(np.mean(self._misses[judged])))

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """(k,) transformed responses at (k, d) inputs."""
        return self.with_slope(x, [], error=False)[0]

    def with_slope(
        self, x: np.ndarray, columns: Sequence[int], error: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Responses (k,), their derivatives (k, c) by the inputs in `columns`, and where `error`
        their variances (k,).

        The variance is the mean squared leave-one-out error of the runs nearby, weighted by their
        distance in the process' lengths, together with that of all runs at the weight of one; of it
        the share that is not scatter.
        """
        value, slope = self.with_slopes(x, columns)
        return value, slope, self._variance(x) if error else None

    def _variance(self, x):
        near = (next(self._parts(x, self.x)) / self._variances[0]) ** 4  # half the lengths
        variance = (near @ self._misses + self.error**2) / (near.sum(1) + 1.0)
        if not self._nugget:
            return variance
        left = self.mean(x)[1] / self.spread**2
        return variance * left / (left + self._nugget)

    def correlation(self, x: np.ndarray) -> np.ndarray:
        """Correlation (k, k) of the errors at k inputs: of the process given its runs, for it is
        wrong smoothly."""
        return correlation_of(self.predict(x)[1], self.spread**2 * self._own(x).max())


def correlation_of(covariance: np.ndarray, whole: float) -> np.ndarray:
    """Correlation (k, k) of errors with a covariance (k, k); whole: variance without any run. Next
    to a run nothing is left but rounding, which is alike nowhere."""
    size = np.sqrt(np.maximum(np.diag(covariance), 0.0) + 1e-6 * whole)
    out = np.clip(covariance / np.outer(size, size), -1.0, 1.0)
    np.fill_diagonal(out, 1.0)
    return out
