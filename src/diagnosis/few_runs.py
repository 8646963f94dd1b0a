"""Emulators of a budget's runs: a dozen to forty of an experiment, some of which repeat a point.

Such runs tell poorly how smooth a response is and how much it scatters. The likeliest values of
both take a response for smoother, and runs for steadier, than they are. So each has a prior, runs
that repeat a point keep the scatter from vanishing, and the variance of a prediction is that of the
process with the degrees of freedom that the fit has spent paid for.

The process is smooth over the coefficients and levers, linear in them, and has an error of its own
at each level of the levers: a rig of a few hundred grains does not follow their size smoothly. What
the runs of a level tell of it stands for all coefficients.

Runs of a mechanism belong to the same process. What the mechanism adds is t (a + b t + c (x - 1/2))
with t the distance of the coded strength from where it is off, x the coefficients and levers in
[0, 1], normal priors of a, b and c, and t times a smooth process for what saturates (Rasmussen and
Williams 2006, Gaussian Processes for Machine Learning, 2.7).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.spatial.distance import cdist

from calibration.inference.emulator import Emulator, correlation_of
from calibration.inference.gaussian_process import GaussianProcess

EFFECT, BEND, MIXED = 2.0, 1.0, 1.0
"""Prior standard deviations of a, b and c, in the standard deviation of the base model's response
over its design."""

PRIORS = {
    "scale": (np.log(0.5), 1.5),
    "linear": (np.log(0.5), 1.5),
    "offset": (np.log(0.5), 1.0),
    "step": (np.log(0.05), 1.5),
    "noise": (np.log(0.05), 1.5),
    "length": (np.log(1.5), 0.7),
}
"""Means and standard deviations of the logarithms: variances in that of the response, lengths in
the range of an input."""

BENT = 2.0, 0.4, 1.0
"""Of what a mechanism adds beyond these terms: prior standard deviation of its ratio to t, in the
same, and the lengths over which it varies in t and in x."""

SIZES = np.geomspace(0.1, 3.0, 8)
"""Factors on these priors that are alike probable: some mechanisms do next to nothing."""


class FewRuns(Emulator):
    """The base model's emulator. See the module.

    x: (n, d) inputs of single runs in [0, 1]; z: (n,) their responses; levers: columns of x.
    """

    def __init__(self, x: ArrayLike, z: ArrayLike, levers: Sequence[int]) -> None:
        GaussianProcess.__init__(self, rough=False, steps=levers, priors=PRIORS)
        self.fit(x, z, np.ones(len(np.asarray(z))))
        self._leave_out(slice(None))
        self.runs, inputs = self.x.shape
        self.paid = self.runs / max(self.runs - inputs - 1.0, 1.0)
        self.scatter = self.spread * float(np.sqrt(self.noise))

    def _variance(self, x):
        """The process' own variance (k,), its spent degrees of freedom paid for."""
        return self.paid * self.mean(x)[1]


class WithMechanism(FewRuns):
    """The emulator of a mechanism, by the base model's runs and its own. See the module.

    base: `FewRuns`; x: (n, d + 1) inputs, the coded strength last; z: (n,) responses of single
    runs; off: coded strength at which the mechanism does nothing, None where its range does not
    reach so far: then a constant of its own is added.
    """

    def __init__(
        self, base: FewRuns, base_z: ArrayLike, x: ArrayLike, z: ArrayLike, off: float | None
    ) -> None:
        x = np.asarray(x, float)
        vars(self).update(vars(base))
        self.off = np.nan if off is None else float(off)
        self.x = np.vstack([base.x, x[:, :-1]])
        terms, _ = _terms(x, self.off)
        self.prior = _prior(base.x.shape[1], self.off)
        self.terms = self.prior * np.vstack([np.zeros((len(base.x), terms.shape[1])), terms])
        self.at = np.append(np.zeros(len(base.x)), self._distance(x))
        responses = np.concatenate([np.asarray(base_z, float), np.asarray(z, float)])
        responses = (responses - self.middle) / self.spread
        of_base = self._covariance(self.x, self.x) + self.noise * np.eye(len(self.x))
        self.size = 1.0
        self.size = _size(of_base, self._of_mechanism(), responses)
        self.prior, self.terms = self.size * self.prior, self.size * self.terms
        root = np.linalg.cholesky(of_base + self._of_mechanism())
        self._root = solve_triangular(root, np.eye(len(root)), lower=True).T
        self.alpha = self._root @ (self._root.T @ responses)
        self._leave_out(slice(len(base.x), None))
        self.runs = len(x)
        self.added = self.prior * (self.terms.T @ self.alpha)

    def _of_mechanism(self):
        """Covariance (n, n) of what the mechanism adds to the runs."""
        return self.terms @ self.terms.T + self._bent(self.x, self.at, self.x, self.at)

    def _distance(self, x):
        """Distance t (k,) of the coded strengths from where the mechanism is off."""
        return x[:, -1] - (self.off if np.isfinite(self.off) else 0.5)

    def _bent(self, x, t, y, s):
        """Prior covariance (k, m) of what the terms do not hold, at inputs (k, d) and distances
        (k,) and others (m, d), (m,)."""
        bend, length, reach = BENT
        square = cdist(x / reach, y / reach, "sqeuclidean")
        near = np.exp(-0.5 * (square + ((t[:, None] - s) / length) ** 2))
        return (self.size * bend) ** 2 * t[:, None] * s * near

    def with_slope(
        self, x: np.ndarray, columns: Sequence[int], error: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """As `Emulator.with_slope`; the last input is the coded strength."""
        last, columns = x.shape[1] - 1, np.asarray(columns, int)
        terms, by_input = _terms(x, self.off)
        own = columns != last
        value, of_base = self.with_slopes(x[:, :-1], columns[own])
        bent, of_bent = self._bent_response(x)
        more = np.einsum("ncq,q->nc", by_input[:, columns], self.added) + of_bent[:, columns]
        slope = self.spread * more
        slope[:, own] += of_base
        variance = self._variance(x) if error else None
        return value + self.spread * (terms @ self.added + bent), slope, variance

    def _bent_response(self, x):
        """What the runs say of the rest (k,) beyond the terms, and its derivatives (k, d + 1)."""
        t, (_, length, reach) = self._distance(x), BENT
        part = self._bent(x[:, :-1], t, self.x, self.at) * self.alpha
        value, slope = part.sum(1), np.empty(x.shape)
        slope[:, :-1] = (part @ self.x - x[:, :-1] * value[:, None]) / reach**2
        near = np.divide(part, t[:, None], out=np.zeros_like(part), where=t[:, None] != 0.0)
        slope[:, -1] = (near - part * (t[:, None] - self.at) / length**2).sum(1)
        return value, slope

    def _crossed(self, x):
        """Covariance (k, n) with the runs, and terms (k, q) over their priors, at (k, d + 1)."""
        terms = self.prior * _terms(x, self.off)[0]
        bent = self._bent(x[:, :-1], self._distance(x), self.x, self.at)
        return self._covariance(x[:, :-1], self.x) + terms @ self.terms.T + bent, terms

    def _variance(self, x):
        cross, terms = self._crossed(x)
        own = self._own(x[:, :-1]) + (self.size * BENT[0] * self._distance(x)) ** 2
        left = own + (terms * terms).sum(1) - ((cross @ self._root) ** 2).sum(1)
        return self.paid * self.spread**2 * np.maximum(left, 0.0)

    def correlation(self, x: np.ndarray) -> np.ndarray:
        """As `Emulator.correlation`."""
        cross, terms = self._crossed(x)
        u, t = x[:, :-1], self._distance(x)
        own = self._covariance(u, u) + terms @ terms.T + self._bent(u, t, u, t)
        known = cross @ self._root
        return correlation_of(own - known @ known.T, np.diag(own).max())


def _size(of_base, more, z):
    """How large what a mechanism adds is, in its priors: the root mean square of what responses z
    (n,) think of the sizes of SIZES. of_base, more: covariances (n, n) of the base model's process
    and of what the mechanism adds at size 1."""
    density = np.empty(len(SIZES))
    for k, size in enumerate(SIZES):
        root = cho_factor(of_base + size**2 * more, lower=True)
        density[k] = -0.5 * z @ cho_solve(root, z) - np.log(np.diag(root[0])).sum()
    weight = np.exp(density - density.max())
    return float(np.sqrt(weight @ SIZES**2 / weight.sum()))


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
