"""What runs tell of an experiment's reading: one cubic response over coefficients and levers, its
errors those of the runs.

The response is a sum of monomials of the inputs, each weight normal about zero (Bayesian linear
regression: Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, 2.1). Each setting
of the levers that was run has a level of its own besides, for a rig of a few hundred grains follows
their size no smooth way. How large each kind of weight is, and how much runs scatter at each
setting, are the likeliest values beside priors of their logarithms. The covariance of the weights
is the Monte Carlo error of whatever is read of them.

What a mechanism adds is t times such a response, with t the distance of its coded strength from
where it is off, and t times what bends over the strength, linear in the inputs. Its weights join
those that the base model's runs leave. What it adds may miss by a share of t besides, for few runs
do not tell whether its form holds.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.special import logsumexp

MOST_SITES = 12
"""Settings of the levers that have levels of their own, at most."""

SHORT = 0.4
"""Length over which what is a setting's own reaches, in the least gap between settings."""

USUAL = 1.0, 0.5, 0.02, 0.1, 0.02, 0.05
"""Variances of the weights that are likely beforehand, in that of the responses: of the mean, of
slopes, products of two inputs, squares and cubes, and of a setting's own level."""

SCATTER = 0.05
"""Variance of runs that is likely beforehand, in the same."""

SPREAD = 2.0, 1.5, 0.5
"""Standard deviations of the logarithms of a kind of weight, of the scatter of runs, and of that of
a setting's own scatter in it."""

LEAST = np.log(1e-8)  # variance of runs over that of responses

ADDED = 2.0, 0.5, 0.25, 0.25, 0.15, 0.3
"""Prior standard deviations of the same kinds of weights of what a mechanism adds, over t, in that
of the base model's responses."""

BENT, LENGTH = 2.0, 0.4
"""Prior standard deviation of what a mechanism adds beyond, over t, and the strength over which it
bends."""

CENTRES, WIDTH = np.linspace(0.0, 1.0, 5), LENGTH / np.sqrt(2.0)
"""Coded strengths and widths of the bumps of which that consists."""

SIZES = np.geomspace(0.1, 3.0, 8)
"""Factors on these priors that are alike probable: some mechanisms do next to nothing."""

MISSES = np.array([0.0, 0.01, 0.03, 0.1, 0.3])
"""By how much what a mechanism adds may miss, over t, that are alike probable, in the same."""


class Response:
    """The response of the base model. See the module.

    x: (n, d) inputs of single runs in [0, 1]; z: (n,) their responses; levers: columns of x.
    """

    def __init__(self, x: ArrayLike, z: ArrayLike, levers: Sequence[int]) -> None:
        x, z = np.asarray(x, float), np.asarray(z, float)
        self.runs, inputs = x.shape
        self.levers = list(levers)
        self.sites, self.reach = _sites(x[:, self.levers])
        self.middle, self.spread = float(z.mean()), float(z.std()) or 1.0
        y, kinds = (z - self.middle) / self.spread, self._kinds(inputs)
        features, near = self._features(x), self._near(x)
        sizes, noise = _likeliest(features, kinds, near, y)
        self.noise = noise  # logarithms (1 + s,) of the variance: of all runs, and of each site
        self.own_level = float(sizes[-1])
        self.paid = self.runs / max(self.runs - inputs - 1.0, 1.0)
        self.mean = np.zeros(len(kinds))
        self.covariance = np.diag(sizes[kinds])
        self._learn(features, y, self._variance_of_runs(x))
        self.scatter = self.spread * float(np.sqrt(self._variance_of_runs(x).mean()))

    def _learn(self, features, y, noise):
        """Update the weights by runs with responses y (n,), and keep how far each is missed when it
        is left out."""
        gain = self.covariance @ features.T
        known = features @ gain + np.diag(noise)
        inverse = np.linalg.inv(known)
        off = inverse @ (y - features @ self.mean)
        self.mean = self.mean + gain @ off
        self.covariance = self.covariance - gain @ inverse @ gain.T
        missed = off / np.diag(inverse)
        self.error = self.spread * float(np.sqrt(np.mean(missed**2)))

    def _kinds(self, inputs):
        """Of which kind (q,) each weight is."""
        i, j = _pairs(inputs)
        counts = [1, inputs, inputs, len(self.sites)]
        one, slope, cube, level = np.split(np.repeat([0, 1, 4, 5], counts), np.cumsum(counts)[:-1])
        return np.concatenate([one, slope, np.where(i == j, 3, 2), cube, level])

    def _near(self, x):
        """How near (k, s) inputs are to each site."""
        apart = (x[:, None, self.levers] - self.sites) / self.reach
        return np.exp(-0.5 * (apart**2).sum(2))

    def _features(self, x):
        """Features (k, q) at x (k, d): their sum times the weights is the response."""
        return np.hstack([_monomials(x), self._near(x)])

    def _variance_of_runs(self, x):
        """Variance (k,) of single runs at x (k, d), in that of the responses."""
        return np.exp(np.maximum(self.noise[0] + self._near(x) @ self.noise[1:], LEAST))

    def sd_of_run(self, x: np.ndarray) -> np.ndarray:
        """Standard deviation (k,) of single runs at inputs x (k, d)."""
        sd: np.ndarray = self.spread * np.sqrt(self._variance_of_runs(x))
        return sd

    def predict(self, x: np.ndarray, error: bool = True) -> tuple[np.ndarray, np.ndarray | None]:
        """Responses (k,) at inputs x (k, d) and, where `error`, their variances (k,): those of the
        weights, the degrees of freedom that were spent paid for, and beside the settings that were
        run that of a setting's own level."""
        features, variance = self._features(x), None
        if error:
            left = ((features @ self.covariance) * features).sum(1) + self._unknown(x)
            variance = self.paid * self.spread**2 * np.maximum(left, 0.0)
        return self.middle + self.spread * (features @ self.mean), variance

    def _unknown(self, x):
        """Variance (k,) of levels beside the sites."""
        return self.own_level * np.maximum(1.0 - (self._near(x) ** 2).sum(1), 0.0)

    def correlation(self, x: np.ndarray) -> np.ndarray:
        """Correlation (k, k) of the errors at k inputs."""
        features = self._features(x)
        covariance = features @ self.covariance @ features.T + np.diag(self._unknown(x))
        size = np.sqrt(np.maximum(np.diag(covariance), 0.0) + 1e-12)
        out = np.clip(covariance / np.outer(size, size), -1.0, 1.0)
        np.fill_diagonal(out, 1.0)
        return out


class WithMechanism(Response):
    """The response with a mechanism, by the base model's runs and its own. See the module.

    base: `Response`; x: (n, d + 1) inputs, the coded strength last; z: (n,) responses of single
    runs; off: coded strength at which the mechanism does nothing, None where its range does not
    reach so far: then a constant of its own is added.
    """

    def __init__(self, base: Response, x: ArrayLike, z: ArrayLike, off: float | None) -> None:
        vars(self).update(vars(base))
        x, z = np.asarray(x, float), np.asarray(z, float)
        self.off = np.nan if off is None else float(off)
        y, features = (z - self.middle) / self.spread, self._features(x)
        noise, known = self._variance_of_runs(x), len(base.mean)
        prior = self._prior(x.shape[1] - 1)
        old, new = features[:, :known], features[:, known:]
        of_base = old @ base.covariance @ old.T + np.diag(noise)
        t = self._distance(x)
        size, self.miss = _size(of_base, (new * prior**2) @ new.T, y - old @ base.mean, t)
        self.mean = np.concatenate([base.mean, np.zeros(len(prior))])
        self.covariance = np.zeros((len(self.mean),) * 2)
        self.covariance[:known, :known] = base.covariance
        self.covariance[known:, known:] = np.diag((size * prior) ** 2)
        self._learn(features, y, noise + (self.miss * t) ** 2)
        self.runs = len(x)

    def _distance(self, x):
        """Distance t (k,) of the coded strengths from where the mechanism is off."""
        return x[:, -1] - (self.off if np.isfinite(self.off) else 0.5)

    def _prior(self, inputs):
        """Prior standard deviations (q,) of what the mechanism adds, at size 1."""
        bent = BENT / len(CENTRES) ** 0.5 * np.repeat([1.0, 0.5], [1, inputs])
        constant = ADDED[:1] * (not np.isfinite(self.off))
        return np.concatenate(
            [np.array(ADDED)[self._kinds(inputs)], *[bent] * len(CENTRES), constant]
        )

    def _features(self, x):
        base, t = super()._features(x[:, :-1]), self._distance(x)[:, None]
        bumps = np.exp(-0.5 * ((x[:, -1:] - CENTRES) / WIDTH) ** 2)
        linear = base[:, : x.shape[1]]
        products = bumps[:, :, None] * linear[:, None, :]
        bent = products.reshape(len(x), bumps.shape[1] * linear.shape[1])
        constant = np.ones((len(x), int(not np.isfinite(self.off))))
        return np.hstack([base, t * base, t * bent, constant])

    def _unknown(self, x):
        return super()._unknown(x[:, :-1]) + (self.miss * self._distance(x)) ** 2


def _sites(at):
    """Settings (s, levers) at which runs (n, levers) were made, and how far each reaches; none
    where they are as many as runs at random are."""
    sites, counts = np.unique(np.round(at, 6), axis=0, return_counts=True)
    sites = sites[counts > 1]
    if not 1 < len(sites) <= MOST_SITES:
        sites = sites[:0]
    gaps = [np.diff(np.unique(column)).min(initial=1.0) for column in sites.T]
    return sites, SHORT * np.array(gaps)


_pairs = cache(np.triu_indices)


def _monomials(x):
    """1, u, u_i u_j and u^3 (k, q) of u = 2 x - 1 at x (k, d)."""
    u = 2.0 * x - 1.0
    i, j = _pairs(x.shape[1])
    return np.hstack([np.ones((len(x), 1)), u, u[:, i] * u[:, j], u**3])


def _likeliest(features, kinds, near, y):
    """Variances (6,) of the kinds of weights, and logarithms (1 + s,) of that of runs, that are
    likeliest with responses y (n,)."""
    present = np.unique(kinds)
    parts = [features[:, kinds == k] @ features[:, kinds == k].T for k in present]
    usual = np.log(USUAL)[present]
    scale = np.concatenate(
        [np.full(len(parts), SPREAD[0]), SPREAD[1:2], np.full(near.shape[1], SPREAD[2])]
    )
    middle = np.concatenate([usual, [np.log(SCATTER)], np.zeros(near.shape[1])])
    weights = np.column_stack([np.ones(len(y)), near])

    def cost(v):
        at = middle + scale * v
        sizes = np.exp(at[: len(parts)])
        noise = np.exp(np.maximum(weights @ at[len(parts) :], LEAST))
        known = sum(s * p for s, p in zip(sizes, parts, strict=True)) + np.diag(noise)
        inverse = np.linalg.inv(known)
        off = inverse @ y
        value = 0.5 * (y @ off + np.linalg.slogdet(known)[1] + v @ v)
        curved = 0.5 * (inverse - np.outer(off, off))
        slope = [s * (curved * p).sum() for s, p in zip(sizes, parts, strict=True)]
        slope = np.concatenate([slope, weights.T @ (np.diag(curved) * noise)])
        return value, scale * slope + v

    within = [(-4.0, 4.0)] * len(parts) + [(-12.0, 4.0)] + [(-4.0, 4.0)] * near.shape[1]
    found = minimize(cost, np.zeros(len(middle)), jac=True, method="L-BFGS-B", bounds=within)
    at = middle + scale * found.x
    sizes = np.zeros(len(USUAL))
    sizes[present] = np.exp(at[: len(parts)])
    return sizes, at[len(parts) :]


def _size(of_base, more, y, t):
    """How large what a mechanism adds is, in its priors, and by how much it misses over t (n,): the
    root mean squares of what residuals y (n,) think of SIZES and MISSES. of_base, more: covariances
    (n, n) of the runs without what it adds, and of that at size 1."""
    density = np.empty((len(SIZES), len(MISSES)))
    for place, size in enumerate(SIZES):
        for also, miss in enumerate(MISSES):
            known = of_base + size**2 * more + np.diag((miss * t) ** 2)
            log = np.linalg.slogdet(known)[1]
            density[place, also] = -0.5 * (y @ np.linalg.solve(known, y) + log)
    weight = np.exp(density - logsumexp(density))
    return tuple(
        float(np.sqrt(weight.sum(axis) @ tried**2)) for axis, tried in ((1, SIZES), (0, MISSES))
    )
