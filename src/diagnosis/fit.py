"""Posterior mode and its Laplace covariance, for many data sets at once.

Gauss-Newton with Levenberg's damping from several starts, within bounds: a parameter at a bound
that the gradient drives outwards is held there while the others move. The spread is that at the
start of a descent, so there are two.

Tests that end without a value are binomial beside the Gaussian readings: Fisher scoring in place of
Gauss-Newton. Errors that readings of a batch or an instrument share are integrated out: the
readings have a covariance, which the model of the table has told (`diagnosis.bulk`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit, xlogy

from calibration.inference.chance_of_no_value import log_likelihood
from calibration.intake.measurements import Measurement
from diagnosis.model import Model
from diagnosis.reading_errors import stated_sd

STARTS = (0.2, 0.7)
DESCENTS = 2
ITERATIONS = 14  # of a descent, at most
SETTLED = 1e-3  # fall of twice the negative log posterior below which a fit has settled
STUCK = 1e6  # damping at which no step helps any more


@dataclass(frozen=True)
class Data:
    """b data sets of n conditions: means and their standard errors (b, n), without the emulators'
    share; of `tests` (c,) under the model's further conditions `failed` (b, c) gave no value.
    shared (n, n): covariance of the errors that readings share, None where they share none; group
    (n,): number of the experiment of each condition, None where all are of one."""

    value: np.ndarray
    error: np.ndarray
    failed: np.ndarray | None = None
    tests: np.ndarray | None = None
    shared: np.ndarray | None = None
    group: np.ndarray | None = None

    def of(self, rows: np.ndarray) -> "Data":
        """The data sets `rows` (m,)."""
        failed = None if self.failed is None else self.failed[rows]
        return replace(self, value=self.value[rows], error=self.error[rows], failed=failed)


@dataclass(frozen=True)
class _Spread:
    """Standard deviations sd (b, n) of readings without what they share, and the roots (b, n, n)
    that make residuals over sd independent, None where nothing is shared."""

    sd: np.ndarray
    root: np.ndarray | None = None

    def of(self, rows):
        """That of the data sets `rows` (m,)."""
        return _Spread(self.sd[rows], None if self.root is None else self.root[rows])

    def scaled(self, x):
        """Values (b, n), or derivatives (b, n, p), of independent residuals of unit spread."""
        x = x / self.sd if x.ndim == 2 else x / self.sd[:, :, None]
        if self.root is None:
            return x
        return np.einsum("bij,bj...->bi...", self.root, x)

    @property
    def log(self):
        """Half the log determinant (b,) of the covariance."""
        own = np.log(self.sd).sum(1)
        if self.root is None:
            return own
        return own - np.log(np.einsum("bii->bi", self.root)).sum(1)


@dataclass(frozen=True)
class Fit:
    """theta (b, p); cov (b, p, p), widened where an experiment misfits; predicted, residual (in
    units of sd), sd (b, n); deviances: of the tests (b, c), chi-squares for many tests of a
    condition; common (b, n): what the errors that readings share are expected to add to
    `predicted`; residuals are of both."""

    theta: np.ndarray
    cov: np.ndarray
    predicted: np.ndarray
    residual: np.ndarray
    sd: np.ndarray
    chi_square: np.ndarray
    freedom: np.ndarray
    deviances: np.ndarray
    common: np.ndarray

    @property
    def expected(self) -> np.ndarray:
        """Return what readings would be (b, n) without an error of their own: `predicted` and
        `common`."""
        return self.predicted + self.common


def fit(model: Model, data: Data, starts: Sequence[float] = STARTS) -> Fit:
    """`Fit` of the model to each of the data sets, the best from several coded strengths to start
    from."""
    k, modes = len(model.mechanisms), []
    for start in starts if k else (0.5,):
        theta = np.tile(model.prior_mean, (len(data.value), 1))
        if k:
            theta[:, -k:] = start
        for _ in range(DESCENTS):
            theta = _descend(model, data, theta)
        modes.append(theta)
    theta = modes[0]
    if len(modes) > 1:
        costs = [misfit(model, data, mode) for mode in modes]
        theta = np.stack(modes)[np.argmin(costs, axis=0), np.arange(len(data.value))]
    return _summary(model, data, theta)


def misfit(model: Model, data: Data, theta: np.ndarray) -> np.ndarray:
    """Twice the negative log posterior (b,), up to a constant, with the spread at theta itself."""
    value, emulator = model.predict(theta)
    spread = _spread(data, emulator)
    return _cost(model, data, theta, value, spread) + 2.0 * spread.log


def _spread(data, emulator):
    """`_Spread` of readings with errors of the emulators (b, n)."""
    sd = np.hypot(data.error, emulator)
    if data.shared is None:
        return _Spread(sd)
    together = data.shared / (sd[:, :, None] * sd[:, None, :])
    return _Spread(sd, np.linalg.inv(np.linalg.cholesky(together + np.eye(sd.shape[1]))))


def _cost(model, data, theta, value, spread):
    """The same with a given spread, less what does not depend on theta."""
    r = spread.scaled(data.value - value)
    q = (theta - model.prior_mean) / model.prior_sd
    cost = (r * r).sum(1) + (q * q).sum(1)
    if data.failed is None:
        return cost
    odds, _ = model.odds(theta)
    return cost - 2.0 * log_likelihood(odds, data.failed, data.tests).sum(1)


def _descend(model, data, theta):
    """Modes (b, p) from starts (b, p), the spread held; a data set that has settled is left
    alone."""
    theta = theta.copy()
    (value, emulator), slope = model.predict(theta), model.slope(theta)
    spread = _spread(data, emulator)
    damping = np.full(len(theta), 1e-2)
    cost = _cost(model, data, theta, value, spread)
    moving = np.arange(len(theta))
    for _ in range(ITERATIONS):
        own, near = data.of(moving), spread.of(moving)
        trial = _step(
            model, own, theta[moving], value[moving], slope[moving], near, damping[moving]
        )
        there, _ = model.predict(trial, errors=False)
        after = _cost(model, own, trial, there, near)
        fall = cost[moving] - after
        better = fall > 0.0
        rows = moving[better]
        theta[rows], cost[rows] = trial[better], after[better]
        value[rows], slope[rows] = there[better], model.slope(trial[better])
        damping[moving] *= np.where(better, 0.2, 8.0)
        moving = moving[np.where(better, fall > SETTLED, damping[moving] < STUCK)]
        if not len(moving):
            break
    return theta


def _held(model, theta, gradient):
    """Which parameters (b, p) are at a bound that the gradient of the posterior drives them
    beyond."""
    return ((theta <= model.low) & (gradient < 0.0)) | ((theta >= model.high) & (gradient > 0.0))


def _curvature(model, j):
    """Half the Hessian (b, p, p) of twice the negative log posterior, as Gauss and Newton have
    it."""
    return np.einsum("bnp,bnq->bpq", j, j) + np.diag(1.0 / model.prior_sd**2)


def _gradient(model, theta, j, r):
    """Half the derivative (b, p) of twice the log posterior by theta."""
    return np.einsum("bnp,bn->bp", j, r) - (theta - model.prior_mean) / model.prior_sd**2


def _with_tests(model, data, theta, j, r):
    """Scaled derivatives (b, n + c, p) and residuals (b, n + c) with those of the tests behind
    them: their score is that of a Gaussian reading of the same information."""
    if data.failed is None:
        return j, r
    odds, by_theta = model.odds(theta)
    chance = expit(odds)
    root = np.sqrt(np.maximum(data.tests * chance * (1.0 - chance), 1e-12))
    more = (data.failed - data.tests * chance) / root
    return np.concatenate([j, root[:, :, None] * by_theta], 1), np.concatenate([r, more], 1)


def _step(model, data, theta, value, slope, spread, damping):
    """Where a damped Gauss-Newton step leads, within the bounds."""
    j, r = spread.scaled(slope), spread.scaled(data.value - value)
    j, r = _with_tests(model, data, theta, j, r)
    hessian = _curvature(model, j)
    gradient = _gradient(model, theta, j, r)
    diagonal = np.einsum("bpp->bp", hessian)
    damped = hessian + (damping[:, None] * diagonal)[:, :, None] * np.eye(theta.shape[1])
    free = ~_held(model, theta, gradient)
    damped = np.where(free[:, :, None] & free[:, None, :], damped, np.eye(theta.shape[1]))
    move = np.linalg.solve(damped, np.where(free, gradient, 0.0)[:, :, None])[:, :, 0]
    return np.clip(theta + move, model.low, model.high)


def _summary(model, data, theta):
    (value, emulator), slope = model.predict(theta), model.slope(theta)
    n, off = value.shape[1], data.value - value
    spread = _spread(data, emulator)
    j, r = _with_tests(model, data, theta, spread.scaled(slope), spread.scaled(off))
    # a parameter that is held at its bound follows no reading
    moves = j * ~_held(model, theta, _gradient(model, theta, j, r))[:, None, :]
    inner = np.linalg.inv(_curvature(model, moves))
    leverage = np.einsum("bnp,bpq,bnq->bn", moves, inner, moves)[:, :n].clip(0.0, 0.9999)
    r = r[:, :n]
    chi = (r * r).sum(1)
    freedom = np.maximum(r.shape[1] - leverage.sum(1), 1.0)
    j[:, :n] /= _misfit_scale(data, r, leverage)[:, :, None]
    cov = np.linalg.inv(_curvature(model, j))
    # of correlated readings the residual of each is what the others do not tell of it
    residual = r if spread.root is None else np.einsum("bij,bi->bj", spread.root, r)
    common = off - residual * spread.sd
    deviances = _deviances(model, data, theta)
    return Fit(theta, cov, value, residual, spread.sd, chi, freedom, deviances, common)


def _misfit_scale(data, r, leverage):
    """Factor (b, n) on the spread of each reading, from independent residuals (b, n) and leverages:
    the root of chi-square over the degrees of freedom of its experiment, at least 1."""
    scale = np.ones_like(r)
    group = np.zeros(r.shape[1], int) if data.group is None else data.group
    for own in (group == g for g in np.unique(group)):
        freedom = np.maximum(own.sum() - leverage[:, own].sum(1), 1.0)
        chi = (r[:, own] ** 2).sum(1)
        scale[:, own] = np.sqrt(np.maximum(chi / freedom, 1.0))[:, None]
    return scale


def _deviances(model, data, theta):
    """Deviances (b, c) of the tests."""
    if data.failed is None:
        return np.zeros((len(theta), 0))
    share = data.failed / data.tests
    best = data.tests * (xlogy(share, share) + xlogy(1.0 - share, 1.0 - share))
    return 2.0 * (best - log_likelihood(model.odds(theta)[0], data.failed, data.tests))


def data_of(measurements: Sequence[Measurement]) -> Data:
    """`Data` of one set of measurements."""
    n = np.array([m.n for m in measurements], float)
    value = np.array([m.value for m in measurements])
    lever = np.array([m.lever_error for m in measurements])
    error = np.hypot(stated_sd(measurements) / np.sqrt(n), lever)
    group = np.unique([m.experiment for m in measurements], return_inverse=True)[1]
    return Data(value[None], error[None], group=group)
