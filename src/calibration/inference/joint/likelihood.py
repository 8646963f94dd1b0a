"""The joint likelihood: what several measured responses of several experiments say of the
parameters.

A response's measured mean is normal about the emulated one with the emulator's error and a stated
discrepancy of the model. Where the measurement's own error is estimated from few readings, the
unknown variance is integrated out (Student's t).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from scipy import stats

from calibration.inference.posterior_sampling import STEPS, Posterior, Prior, sample

SCALES = 15
"""Points at which the unknown variance of few readings is integrated."""
LEAST_WORTH = 100
"""Equal draws that a posterior by weights must be worth; below, the sampler is asked."""
CLOUD, CLOUDS = 20000, 4
"""Draws of the prior at a time, and times, that are weighed before the sampler is asked."""
INDEPENDENT = 2000
"""Equal draws that these must be worth to stand for the posterior."""
MOST_DRAWS = 10000
LEAST_SHARE = 1e-12
"""Of the measurement's own variance: no prediction counts as closer than that."""
MANY = 200
"""Degrees of freedom from which on an estimated error counts as known."""


@dataclass(frozen=True)
class Response:
    """A measured response and its emulator.

    name: for sentences. emulator: its `mean(u)` gives mean and variance (k,) each at u (k, d).
    mean, variance: what was measured, and the variance of that mean. freedom: degrees of freedom
    from which this is estimated, infinite where it is known. discrepancy: standard deviation by
    which the model itself may be wrong.
    """

    name: str
    emulator: Any
    mean: float
    variance: float
    freedom: float = np.inf
    discrepancy: float = 0.0

    def predicted(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Emulated means and variances (k,), the stated discrepancy in them, at u (k, d)."""
        mean, variance = self.emulator.mean(np.atleast_2d(u))
        return mean, variance + self.discrepancy**2

    def log_likelihood(self, u: np.ndarray) -> np.ndarray:
        """(k,) log density of the measured mean at u (k, d)."""
        mean, variance = self.predicted(u)
        return self.log_density(self.mean, mean, self.spread(variance))

    def spread(self, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Variances v + s C of the measured mean about predictions with variances v (k,), at m
        factors s on the measurement's own C: 1 / sqrt(v) (k,), these variances over v (m, k) and
        their logarithms (m, k)."""
        scales, _ = _scales(self.freedom)
        variance = np.maximum(variance, LEAST_SHARE * self.variance)
        size = 1.0 / np.sqrt(variance)
        widths = 1.0 + scales[:, None] * (size * self.variance * size)
        return size, widths, np.log(widths) + np.log(variance)

    def log_density(self, y: float, mean: np.ndarray, spread: Any) -> np.ndarray:
        """(k,) log density of a measured mean about means (k,), with the `spread` of their
        variances."""
        size, widths, log_size = spread
        square = (size * (y - mean)) ** 2 / widths
        logs = -0.5 * (square + log_size + np.log(2.0 * np.pi))
        if len(logs) == 1:
            return logs[0]
        logs, (_, weights) = logs.T, _scales(self.freedom)
        top = logs.max(axis=1)
        return top + np.log(np.exp(logs - top[:, None]) @ weights)

    def misfit(self, y: np.ndarray, mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
        """(n, k) distances of measured means (n,) from predictions (k,) each.

        The squared distance in standard deviations, chi squared where all is normal; where the
        error is estimated, twice the fall of the log density of Student's t instead.
        """
        total, off = self.variance + variance, y[:, None] - mean[None]
        square = off * (1.0 / total) * off
        if not np.isfinite(self.freedom) or self.freedom >= MANY:
            return square
        behind = self.freedom * (total / self.variance) ** 2
        return (behind + 1) * np.log1p(square / behind)

    def drawn(self, mean: np.ndarray, variance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(k,) measured means as they could have come out at predictions (k,) each."""
        own = rng.standard_normal(len(mean)) * np.sqrt(self.variance)
        if np.isfinite(self.freedom) and self.freedom < MANY:
            own *= np.sqrt(self.freedom / rng.chisquare(self.freedom, len(mean)))
        return rng.normal(mean, np.sqrt(variance)) + own


@cache
def _scales(freedom):
    """Factors (m,) on an estimated variance with their weights (m,): nu / chi squared, on an even
    grid of its logarithm."""
    if not np.isfinite(freedom) or freedom >= MANY:
        return np.ones(1), np.ones(1)
    ends = np.log(stats.chi2.ppf([1e-7, 1.0 - 1e-7], freedom))
    x = np.exp(np.linspace(*ends, SCALES))
    weights = stats.chi2.pdf(x, freedom) * x
    return freedom / x, weights / weights.sum()


@dataclass(frozen=True)
class Joint:
    """Responses of all tests, the prior, and what else speaks for parameters (`formed`: objects
    with `log_likelihood`, see `calibration.inference.posterior_sampling.Formed`)."""

    responses: tuple
    prior: Prior
    formed: tuple = field(default=())

    @property
    def names(self) -> list[str]:
        """Names of the responses."""
        return [r.name for r in self.responses]

    def posterior(self, seed: int = 1, steps: int = STEPS) -> Posterior:
        """Its `calibration.inference.posterior_sampling.Posterior`; steps: of `sample` there.

        Where draws of the prior, weighed by the likelihood, are worth `INDEPENDENT` equal ones,
        they are taken: they are independent, and no chain has to find its way along a ridge. Else
        the ensemble of `sample` is asked."""
        rng = np.random.default_rng(seed)
        clouds = [Cloud.of(self, CLOUD, int(rng.integers(2**31))) for _ in range(CLOUDS)]
        u = np.concatenate([c.u for c in clouds])
        log = np.concatenate([c.log_likelihood([r.mean for r in self.responses]) for c in clouds])
        weights = np.exp(log - log.max())
        weights /= weights.sum()
        good = worth(weights)
        if good < INDEPENDENT:
            return sample([*self.responses, *self.formed], self.prior, seed, steps)
        pick = rng.choice(len(u), int(min(good, MOST_DRAWS)), p=weights)
        return Posterior(u[pick], 1.0, good / len(u), good)

    def without(self, name: str) -> "Joint":
        """This study without one response."""
        return replace(self, responses=tuple(r for r in self.responses if r.name != name))

    def predicted(self, u: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """[(means (k,), variances (k,))] of each response at u (k, d)."""
        return [r.predicted(u) for r in self.responses]

    def at(self, measured: Sequence[float]) -> "Joint":
        """This study with other measured means, one a response."""
        pairs = zip(self.responses, measured, strict=True)
        return replace(self, responses=tuple(replace(r, mean=y) for r, y in pairs))


@dataclass(frozen=True)
class Cloud:
    """Draws u (k, d) of the prior with all predictions there: a posterior of any measured values is
    a set of weights of them.

    It serves checks that need hundreds of posteriors of one study; where few draws carry the
    weight, the sampler is asked in its place.
    """

    joint: Joint
    u: np.ndarray
    predicted: list
    formed: np.ndarray

    @classmethod
    def of(cls, joint: Joint, size: int = 20000, seed: int = 1) -> "Cloud":
        """A cloud of `size` draws."""
        u = joint.prior.draw(size, np.random.default_rng(seed))
        formed = sum((f.log_likelihood(u) for f in joint.formed), np.zeros(size))
        return cls(joint, u, joint.predicted(u), formed)

    def weights(self, measured: Sequence[float], but: str | None = None) -> np.ndarray:
        """(k,) weights, of sum 1, under measured means, one a response; `but`: the name of one that
        does not count."""
        log = self.log_likelihood(measured, but)
        weights = np.exp(log - log.max())
        return weights / weights.sum()

    def log_likelihood(self, measured: Sequence[float], but: str | None = None) -> np.ndarray:
        """(k,) log density of measured means, one a response; `but` as of `weights`."""
        log = self.formed.copy()
        parts = zip(self.joint.responses, measured, self.predicted, self._spreads, strict=True)
        for r, y, (mean, _), spread in parts:
            if r.name != but:
                log += r.log_density(y, mean, spread)
        return log

    @cached_property
    def _spreads(self):
        """`Response.spread` of each: the same whatever the values that were measured."""
        parts = zip(self.joint.responses, self.predicted, strict=True)
        return [r.spread(variance) for r, (_, variance) in parts]

    def draws(
        self,
        measured: Sequence[float],
        count: int,
        rng: np.random.Generator,
        but: str | None = None,
    ) -> np.ndarray:
        """(count, d) draws of the posterior under measured means: of the cloud where it is worth
        LEAST_WORTH draws, else the sampler's."""
        weights = self.weights(measured, but)
        if worth(weights) >= LEAST_WORTH:
            return self.u[rng.choice(len(weights), count, p=weights)]
        joint = self.joint.at(measured) if but is None else self.joint.at(measured).without(but)
        draws = joint.posterior(int(rng.integers(2**31))).draws
        return draws[rng.integers(0, len(draws), count)]


def worth(weights: np.ndarray) -> float:
    """Number of equal draws that weights (k,) of sum 1 are worth (Kish)."""
    return 1.0 / float((weights**2).sum())


def least_misfit(joint: Joint, measured: Sequence[np.ndarray], predicted: Sequence) -> np.ndarray:
    """(n,) smallest sums of the responses' misfits over the points (k,) at which all are predicted,
    of n sets of measured means, one (n,) a response."""
    parts = zip(joint.responses, measured, predicted, strict=True)
    return sum(r.misfit(y, *p) for r, y, p in parts).min(axis=1)
