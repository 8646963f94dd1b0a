"""The emulator of a mechanism that few runs train: that of the base model, and what the mechanism
adds to it.

A Gaussian process of its own would need about ten runs an input. What a mechanism adds is smaller,
and nil where it is off: it is taken as t (a + b t + c (x - 1/2)), with t the distance of the coded
strength from where it is off, and x the coefficients and levers in [0, 1]. Runs of a budget tell a
well and the rest as far as they can; normal priors hold what they do not tell, and the variance of
a prediction says how much that is (Bayesian linear regression: Bishop 2006, Pattern Recognition and
Machine Learning, 3.3).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from calibration.inference.emulator import Emulator

EFFECT, BEND, MIXED = 2.0, 1.0, 1.0
"""Prior standard deviations of a, b and c, in the standard deviation of the base model's response
over its design."""

RESOLVED = 1e-3  # least noise of a run, in the same


@dataclass
class Difference:
    """See the module.

    base: `Emulator`; off: coded strength at which the mechanism does nothing, nan where its range
    does not reach so far: then a constant of its own is added. mean (q,), covariance (q, q): of the
    terms' coefficients. error: leave-one-out root mean square; runs: that trained the terms.
    """

    base: Emulator
    off: float
    mean: np.ndarray
    covariance: np.ndarray
    error: float
    runs: int

    @classmethod
    def trained(
        cls, base: Emulator, x: np.ndarray, z: np.ndarray, off: float | None, runs: np.ndarray
    ) -> "Difference":
        """Of mean responses z (n,) of `runs` (n,) runs each at inputs x (n, d + 1), the coded
        strength last; off: None where the mechanism is never off."""
        off = np.nan if off is None else float(off)
        phi, _ = _terms(x, off)
        prior = base.spread * _prior(x.shape[1] - 1, off)
        expected, _, variance = base.with_slope(x[:, :-1], [])
        noise = variance + base.scatter**2 / runs + (RESOLVED * base.spread) ** 2  # type: ignore[operator]
        weighted = phi / noise[:, None]
        covariance = np.linalg.inv(np.diag(prior**-2.0) + phi.T @ weighted)
        rest = z - expected
        mean = covariance @ (weighted.T @ rest)
        leverage = np.einsum("ij,jk,ik->i", weighted, covariance, phi)
        missed = (rest - phi @ mean) / (1.0 - leverage)
        error = float(np.sqrt(np.mean(missed**2)))
        return cls(base, off, mean, covariance, error, int(np.sum(runs)))

    @property
    def scatter(self) -> float:
        """As `Emulator.scatter`."""
        return self.base.scatter

    @property
    def spread(self) -> float:
        """As `Emulator.spread`."""
        return self.base.spread

    def with_slope(
        self, x: np.ndarray, columns: Sequence[int], error: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """As `Emulator.with_slope`; the last input is the coded strength."""
        last = x.shape[1] - 1
        own = [c for c in columns if c != last]
        z, base_slope, variance = self.base.with_slope(x[:, :-1], own, error)
        phi, by_input = _terms(x, self.off)
        slope = np.zeros((len(x), len(columns)))
        slope[:, [k for k, c in enumerate(columns) if c != last]] = base_slope
        slope += np.einsum("ncq,q->nc", by_input[:, columns], self.mean)
        if error:
            variance = variance + np.einsum("nq,qr,nr->n", phi, self.covariance, phi)
        return z + phi @ self.mean, slope, variance

    def correlation(self, x: np.ndarray) -> np.ndarray:
        """As `Emulator.correlation`."""
        phi, _ = _terms(x, self.off)
        sd = np.sqrt(cast(np.ndarray, self.base.with_slope(x[:, :-1], [])[2]))
        total = self.base.correlation(x[:, :-1]) * np.outer(sd, sd)
        total = total + phi @ self.covariance @ phi.T
        size = np.sqrt(np.maximum(np.diag(total), 1e-300))
        return total / np.outer(size, size)


def _prior(inputs, off):
    """Prior standard deviations (q,) of the terms' coefficients."""
    own = np.array([EFFECT, BEND, *[MIXED] * inputs])
    return own if np.isfinite(off) else np.array([EFFECT, *own])


def _terms(x, off):
    """Terms (n, q) at inputs x (n, d + 1), and their derivatives (n, d + 1, q) by the inputs."""
    n, d = x.shape[0], x.shape[1] - 1
    constant = not np.isfinite(off)
    t, u = x[:, -1] - (0.5 if constant else off), x[:, :-1] - 0.5
    phi = np.column_stack([t, t * t, t[:, None] * u])
    by_input = np.zeros((n, d + 1, d + 2))
    by_input[:, np.arange(d), 2 + np.arange(d)] = t[:, None]
    by_input[:, d] = np.column_stack([np.ones(n), 2.0 * t, u])
    if constant:
        phi = np.column_stack([np.ones(n), phi])
        by_input = np.concatenate([np.zeros((n, d + 1, 1)), by_input], axis=2)
    return phi, by_input
