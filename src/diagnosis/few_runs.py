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
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from calibration.inference.emulator import Emulator

SHORT = 0.4
"""Length over which the error of a level reaches, in the least gap between levels of the runs."""

EFFECT, BEND, MIXED = 2.0, 1.0, 1.0
"""Prior standard deviations of a, b and c, in the standard deviation of the base model's response
over its design."""

PRIORS = {
    "scale": (np.log(0.5), 1.5),
    "linear": (np.log(0.5), 1.5),
    "offset": (np.log(0.5), 1.0),
    "level": (np.log(0.05), 1.5),
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

LARGEST = 6.0  # of a logarithm's distance from its mean, in standard deviations
LEAST_NOISE = 1e-6  # variance of a run beside the scatter, for the rounding


class FewRuns(Emulator):
    """The base model's emulator. See the module.

    x: (n, d) inputs of single runs in [0, 1]; z: (n,) their responses; levers: columns of x.
    """

    def __init__(self, x: ArrayLike, z: ArrayLike, levers: Sequence[int]) -> None:
        self.x, z = np.asarray(x, float), np.asarray(z, float)
        self.mean, self.spread = float(z.mean()), float(z.std()) or 1.0
        self.levers = np.array(levers, int)
        self.short = SHORT * _gaps(self.x[:, self.levers])
        response = (z - self.mean) / self.spread
        self._hold(_likeliest(self, response))
        runs, inputs = self.x.shape
        self.paid = runs / max(runs - inputs - 1.0, 1.0)
        self._solve(response)

    def _hold(self, logs):
        """Take the process' values from the vector of their logarithms."""
        names = [n for n in PRIORS if n != "length"]
        values = np.exp(np.clip(logs, -30.0, 30.0))
        for name, value in zip(names, values, strict=False):
            setattr(self, name, float(value))
        self.length = values[len(names) :]
        self.scatter = self.spread * float(np.sqrt(self.noise))

    def _solve(self, response):
        """What predictions need of the runs' covariance."""
        self._inverse = np.linalg.inv(self._of_runs())
        self.alpha = self._inverse @ response
        self._misses = (self.spread * self.alpha / np.diag(self._inverse)) ** 2
        self.error = float(np.sqrt(self._misses.mean()))
        self.runs = len(self.x)

    def _of_runs(self):
        """Covariance (n, n) of the runs' responses."""
        return self._covariance(self.x, self.x) + (self.noise + LEAST_NOISE) * np.eye(len(self.x))

    def _covariance(self, x, y, like=None):
        """Prior covariance (k, m) of the responses, without scatter, at (k, d) and (m, d)
        inputs."""
        like = self._alike(x, y) if like is None else like
        return self.scale * like + self.level * self._same_level(x, y) + self._trend(x, y)

    def _trend(self, x, y):
        return self.linear * ((x - 0.5) @ (y - 0.5).T) + self.offset

    def _same_level(self, x, y):
        """1 (k, m) where (k, d) and (m, d) inputs are of one level, 0 where they are of others."""
        return np.exp(-0.5 * _apart(*(v[:, self.levers] / self.short for v in (x, y))))

    def with_slope(
        self, x: np.ndarray, columns: Sequence[int], error: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """As `Emulator.with_slope`; the variance is the process' own, its spent degrees of freedom
        paid for."""
        columns = np.asarray(columns, int)
        value, slope = self._response(x, columns)
        variance = self.process_variance(x) if error else None
        return self.mean + self.spread * value, self.spread * slope, variance

    def _response(self, x, columns):
        """Responses (k,) over the spread, and their derivatives (k, c)."""
        like, level = self.scale * self._alike(x, self.x), self.level * self._same_level(x, self.x)
        weights = np.column_stack([self.alpha, self.alpha[:, None] * self.x[:, columns]])
        smooth, steps = like @ weights, level @ weights
        trend = self.linear * ((self.x - 0.5).T @ self.alpha)
        value = smooth[:, 0] + steps[:, 0] + (x - 0.5) @ trend + self.offset * self.alpha.sum()
        short = np.full(x.shape[1], np.inf)
        short[self.levers] = self.short
        slope = trend[columns] + sum(
            (part[:, 1:] - x[:, columns] * part[:, :1]) / length[columns] ** 2
            for part, length in ((smooth, self.length), (steps, short))
        )
        return value, slope

    def process_variance(self, x: np.ndarray) -> np.ndarray:
        """Variance (k,) of the process' mean at (k, d) inputs, given its runs."""
        cross = self._covariance(x, self.x)
        own = self.scale + self.level + self.linear * ((x - 0.5) ** 2).sum(1) + self.offset  # type: ignore[attr-defined]  # `_hold` sets it
        left = np.maximum(own - ((cross @ self._inverse) * cross).sum(1), 0.0)
        return self.paid * self.spread**2 * left

    def correlation(self, x: np.ndarray) -> np.ndarray:
        """As `Emulator.correlation`."""
        cross = self._covariance(x, self.x)
        return _correlation(self._covariance(x, x) - cross @ self._inverse @ cross.T)


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
        for name in ("mean", "spread", "levers", "short", "length", "scatter", "paid"):
            setattr(self, name, getattr(base, name))
        for name in (n for n in PRIORS if n != "length"):
            setattr(self, name, getattr(base, name))
        self.off = np.nan if off is None else float(off)
        self.x = np.vstack([base.x, x[:, :-1]])
        terms, _ = _terms(x, self.off)
        self.prior = _prior(base.x.shape[1], self.off)
        self.terms = self.prior * np.vstack([np.zeros((len(base.x), terms.shape[1])), terms])
        self.at = np.append(np.zeros(len(base.x)), self._distance(x))
        responses = np.concatenate([np.asarray(base_z, float), np.asarray(z, float)])
        responses = (responses - self.mean) / self.spread
        self.size = _size(self, responses)
        self.prior, self.terms = self.size * self.prior, self.size * self.terms
        self._solve(responses)
        self.error = float(np.sqrt(self._misses[len(base.x) :].mean()))
        self.runs = len(x)
        self.added = self.prior * (self.terms.T @ self.alpha)

    def _of_runs(self):
        return super()._of_runs() + self._of_mechanism()

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
        square = _apart(x / reach, y / reach)
        near = np.exp(-0.5 * (square + ((t[:, None] - s) / length) ** 2))
        return (self.size * bend) ** 2 * t[:, None] * s * near

    def with_slope(
        self, x: np.ndarray, columns: Sequence[int], error: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """As `FewRuns.with_slope`; the last input is the coded strength."""
        last, columns = x.shape[1] - 1, np.asarray(columns, int)
        terms, by_input = _terms(x, self.off)
        own = columns != last
        value, of_base = self._response(x[:, :-1], columns[own])
        slope = np.einsum("ncq,q->nc", by_input[:, columns], self.added)
        slope[:, own] += of_base
        bent, of_bent = self._bent_response(x)
        slope += of_bent[:, columns]
        variance = self.process_variance(x) if error else None
        value = value + terms @ self.added + bent
        return self.mean + self.spread * value, self.spread * slope, variance

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

    def process_variance(self, x: np.ndarray) -> np.ndarray:
        """As `FewRuns.process_variance`."""
        (cross, terms), u = self._crossed(x), x[:, :-1] - 0.5
        own = self.scale + self.level + self.linear * (u * u).sum(1) + self.offset  # type: ignore[attr-defined]  # as above
        own += (self.size * BENT[0] * self._distance(x)) ** 2
        left = own + (terms * terms).sum(1) - ((cross @ self._inverse) * cross).sum(1)
        return self.paid * self.spread**2 * np.maximum(left, 0.0)

    def correlation(self, x: np.ndarray) -> np.ndarray:
        """As `Emulator.correlation`."""
        cross, terms = self._crossed(x)
        u, t = x[:, :-1], self._distance(x)
        own = self._covariance(u, u) + terms @ terms.T + self._bent(u, t, u, t)
        return _correlation(own - cross @ self._inverse @ cross.T)


def _apart(x, y):
    """Squared distances (k, m) between points (k, d) and (m, d), none below zero by rounding."""
    square = (x * x).sum(1)[:, None] + (y * y).sum(1) - 2.0 * x @ y.T
    return np.maximum(square, 0.0)


def _gaps(levers):
    """Least gap (l,) between the levels of each lever, from the runs' inputs (n, l)."""
    gaps = [np.diff(np.unique(np.round(column, 6))) for column in levers.T]
    return np.array([gap.min() if len(gap) else 1.0 for gap in gaps])


def _likeliest(emulator, z):
    """Logarithms of the process' values of which responses z (n,) and the priors think most."""
    inputs = emulator.x.shape[1]
    names = [n for n in PRIORS if n != "length"] + ["length"] * inputs
    middle, sd = np.array([PRIORS[n] for n in names]).T

    def cost(u):
        emulator._hold(middle + sd * u)
        try:
            root = cho_factor(emulator._of_runs(), lower=True)
        except np.linalg.LinAlgError:
            return 1e10
        log_root = np.log(np.diag(root[0])).sum()
        return float(0.5 * z @ cho_solve(root, z) + log_root + 0.5 * (u @ u))

    bounds = [(-LARGEST, LARGEST)] * len(names)
    found = minimize(cost, np.zeros(len(names)), method="L-BFGS-B", bounds=bounds)
    return middle + sd * found.x


def _size(emulator, z):
    """How large what a mechanism adds is, in its priors: the root mean square of what responses z
    (n,) think of the sizes of SIZES."""
    emulator.size = 1.0
    of_base, more = FewRuns._of_runs(emulator), emulator._of_mechanism()
    density = np.empty(len(SIZES))
    for k, size in enumerate(SIZES):
        root = cho_factor(of_base + size**2 * more, lower=True)
        density[k] = -0.5 * z @ cho_solve(root, z) - np.log(np.diag(root[0])).sum()
    weight = np.exp(density - density.max())
    return float(np.sqrt(weight @ SIZES**2 / weight.sum()))


def _correlation(covariance):
    """Correlation (k, k); next to a run nothing is left but rounding, which is alike nowhere."""
    rounding = 1e-6 * np.diag(covariance).max()
    size = np.sqrt(np.maximum(np.diag(covariance), 0.0) + rounding)
    out = np.clip(covariance / np.outer(size, size), -1.0, 1.0)
    np.fill_diagonal(out, 1.0)
    return out


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
