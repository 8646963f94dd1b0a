"""Posterior mode, its Laplace covariance and leave-one-setting-out scores, for many data sets at
once.

Gauss-Newton with Levenberg's damping from several starts, within bounds: a parameter at a bound
that the gradient drives outwards is held there while the others move. The spread is that at the
start of a descent, so there are two. The score of a left-out setting follows from the fit to all by
its leverage: e_i / (1 - h_i) with variance s_i^2 / (1 - h_i). This is exact if the model is linear
near the mode.

Tests that end without a value are binomial beside the Gaussian readings: Fisher scoring in place of
Gauss-Newton. A test that is left out has the odds that the mode and the leverage leave it without
its own share (Laplace with a cavity: Vehtari and others 2016, J. Mach. Learn. Res. 17:103).

Readings of a batch or an instrument share an error (`diagnosis.reading_errors`). It is integrated
out: the readings then have a covariance, and a setting is left out of that (Rasmussen and Williams
2006, Gaussian Processes for Machine Learning, 5.4.2). How large it is is chosen at the start of a
descent, as the spread is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit, logsumexp, xlogy

from calibration.inference.chance_of_no_value import log_likelihood
from calibration.intake.measurements import Measurement
from diagnosis.model import Model
from diagnosis.reading_errors import Shared, shared_of, spread_unit, stated_sd

STARTS = (0.2, 0.7)
DESCENTS = 2
MORE_DESCENTS = 1  # where errors are shared: the first is made before their size is known
ITERATIONS = 14  # of a descent, at most
SETTLED = 1e-3  # fall of twice the negative log posterior below which a fit has settled
NODES = 21  # of the quadrature over the odds of a test
STUCK = 1e6  # damping at which no step helps any more


@dataclass(frozen=True)
class Data:
    """b data sets of n conditions: means and their standard errors (b, n), without the emulators'
    share; of `tests` (c,) under the model's further conditions `failed` (b, c) gave no value.
    shared: what readings share, None where no column says so; group (n,): number of the experiment
    of each condition, None where all are of one."""

    value: np.ndarray
    error: np.ndarray
    failed: np.ndarray | None = None
    tests: np.ndarray | None = None
    shared: Shared | None = None
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
    units of sd), sd, leverage (b, n); scale (b, n): of the misfit of a reading's experiment; score
    (b,).

    pointwise: held-out log densities (b, n), those of tests without a value behind them (b, n + c);
    deviances: of the tests (b, c), chi-squares for many tests of a condition. common (b, n): what
    the errors that readings share are expected to add to `predicted`; residuals are of both. sizes
    (b, g): posterior probabilities of the sizes of these errors."""

    theta: np.ndarray
    cov: np.ndarray
    predicted: np.ndarray
    residual: np.ndarray
    sd: np.ndarray
    leverage: np.ndarray
    chi_square: np.ndarray
    freedom: np.ndarray
    scale: np.ndarray
    pointwise: np.ndarray
    deviances: np.ndarray
    common: np.ndarray
    sizes: np.ndarray

    @property
    def expected(self) -> np.ndarray:
        """Return what readings would be (b, n) without an error of their own: `predicted` and
        `common`."""
        return self.predicted + self.common

    def shared_errors(self, data: Data) -> dict[tuple[str, str], float]:
        """{(experiment, label): standard deviation} of the errors that readings of the first data
        set share, of the likeliest size."""
        return data.shared.at(int(self.sizes[0].argmax())) if data.shared else {}

    @property
    def score(self) -> np.ndarray:
        """Sum of the held-out log densities (b,)."""
        return self.pointwise.sum(1)


def fit(model: Model, data: Data, starts: Sequence[float] = STARTS) -> Fit:
    """`Fit` of the model to each of the data sets, the best from several coded strengths to start
    from."""
    k, modes = len(model.mechanisms), []
    for start in starts if k else (0.5,):
        theta = np.tile(model.prior_mean, (len(data.value), 1))
        if k:
            theta[:, -k:] = start
        for _ in range(DESCENTS + MORE_DESCENTS * (data.shared is not None)):
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
    sd, costs = np.hypot(data.error, emulator), []
    for place, prior in enumerate(data.shared.prior if data.shared else [0.0]):
        spread = _with_root(data, sd, np.full(len(theta), place))
        costs.append(_cost(model, data, theta, value, spread) + 2.0 * (spread.log - prior))
    return np.min(costs, axis=0)


def _with_root(data, sd, places):
    """`_Spread` with the shared errors of a size each, by their places (b,) on the grid."""
    if data.shared is None:
        return _Spread(sd)
    root = np.empty((*sd.shape, sd.shape[1]))
    for place in np.unique(places):
        rows = places == place
        together = data.shared.covariance[place] / (sd[rows][:, :, None] * sd[rows][:, None, :])
        root[rows] = np.linalg.inv(np.linalg.cholesky(together + np.eye(sd.shape[1])))
    return _Spread(sd, root)


def _spread(model, data, theta, value, emulator, slope):
    """`_Spread` at theta (b, p), and the posterior probabilities (b, g) of the sizes of shared
    errors with the parameters integrated out, linear about theta."""
    sd = np.hypot(data.error, emulator)
    if data.shared is None:
        return _Spread(sd), np.ones((len(sd), 1))
    j, z = slope / sd[:, :, None], (data.value - value) / sd
    z = z + np.einsum("bnp,bp->bn", j, theta - model.prior_mean)
    own = np.einsum("bnp,p,bmp->bnm", j, model.prior_sd**2, j) + np.eye(sd.shape[1])
    over = 1.0 / (sd[:, :, None] * sd[:, None, :])
    density = np.empty((len(sd), len(data.shared.prior)))
    for g, prior in enumerate(data.shared.prior):
        total = own + data.shared.covariance[g] * over
        square = np.einsum("bn,bn->b", z, np.linalg.solve(total, z[:, :, None])[:, :, 0])
        density[:, g] = prior - 0.5 * (square + np.linalg.slogdet(total)[1])
    sizes = np.exp(density - density.max(1, keepdims=True))
    return _with_root(data, sd, density.argmax(1)), sizes / sizes.sum(1, keepdims=True)


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
    value, emulator, slope = model.with_slope(theta)
    spread, _ = _spread(model, data, theta, value, emulator, slope)
    damping = np.full(len(theta), 1e-2)
    cost = _cost(model, data, theta, value, spread)
    moving = np.arange(len(theta))
    for _ in range(ITERATIONS):
        own, near = data.of(moving), spread.of(moving)
        trial = _step(
            model, own, theta[moving], value[moving], slope[moving], near, damping[moving]
        )
        there, _, slope_there = model.with_slope(trial, errors=False)
        after = _cost(model, own, trial, there, near)
        fall = cost[moving] - after
        better = fall > 0.0
        rows = moving[better]
        theta[rows], cost[rows] = trial[better], after[better]
        value[rows], slope[rows] = there[better], slope_there[better]
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
    value, emulator, slope = model.with_slope(theta)
    n, off = value.shape[1], data.value - value
    spread, sizes = _spread(model, data, theta, value, emulator, slope)
    sd = spread.sd
    j, r = _with_tests(model, data, theta, spread.scaled(slope), spread.scaled(off))
    # a parameter that is held at its bound does not follow when a setting is left out
    moves = j * ~_held(model, theta, _gradient(model, theta, j, r))[:, None, :]
    inner = np.linalg.inv(_curvature(model, moves))
    leverage = np.einsum("bnp,bpq,bnq->bn", moves, inner, moves)
    leverage = leverage.clip(0.0, 0.9999)
    tested, deviances = _of_tests(model, data, theta, r[:, n:], leverage[:, n:])
    r, leverage = r[:, :n], leverage[:, :n]
    chi = (r * r).sum(1)
    freedom = np.maximum(r.shape[1] - leverage.sum(1), 1.0)
    scale = _misfit_scale(data, r, leverage)
    r, leverage, common = _apart(spread, r, leverage, moves[:, :n], inner, off)
    left = 1.0 - leverage
    wide = scale * sd / np.sqrt(left)
    pointwise = -0.5 * (r * sd / left / wide) ** 2 - np.log(wide) - 0.5 * np.log(2.0 * np.pi)
    pointwise = np.concatenate([pointwise, tested], 1)
    j[:, :n] /= scale[:, :, None]
    cov = np.linalg.inv(_curvature(model, j))
    return Fit(
        theta, cov, value, r, sd, leverage, chi, freedom, scale, pointwise, deviances, common, sizes
    )


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


def _apart(spread, r, leverage, j, inner, off):
    """Residuals over sd, leverages and what is shared (b, n) of the readings one by one, of the
    residuals r, leverages and derivatives j of independent ones.

    With P the inverse covariance over sd, parameters integrated out, a setting that is left out is
    missed by (P z)_i / P_ii with variance 1 / P_ii: the residual is P z, the leverage 1 - P_ii."""
    if spread.root is None:
        return r, leverage, np.zeros_like(off)
    residual = np.einsum("bij,bi->bj", spread.root, r)
    whole = np.einsum("bij,bij->bj", spread.root, spread.root)
    pulled = np.einsum("bij,bip->bjp", spread.root, j)
    by_theta = np.einsum("bjp,bpq,bjq->bj", pulled, inner, pulled)
    leverage = (1.0 - whole + by_theta).clip(0.0, 0.9999)
    return residual, leverage, off - residual * spread.sd


def _of_tests(model, data, theta, r, leverage):
    """Held-out log probabilities (b, c) of the tests, and their deviances."""
    if data.failed is None:
        return np.zeros((len(theta), 0)), np.zeros((len(theta), 0))
    odds, _ = model.odds(theta)
    chance = expit(odds)
    root = np.sqrt(np.maximum(data.tests * chance * (1.0 - chance), 1e-12))
    # what the others say of the odds: their mean and variance without the test
    variance = leverage / (1.0 - leverage) / root**2
    score = held_out(odds - variance * root * r, variance, data)
    share = data.failed / data.tests
    best = data.tests * (xlogy(share, share) + xlogy(1.0 - share, 1.0 - share))
    at_mode = log_likelihood(odds, data.failed, data.tests)
    return score, 2.0 * (best - at_mode)


def held_out(mean: np.ndarray, variance: np.ndarray, data: Data) -> np.ndarray:
    """Log probability (b, c) of what the tests ended with, their odds' logarithms normal with mean
    and variance (b, c)."""
    at, weight = np.polynomial.hermite_e.hermegauss(NODES)
    odds = mean[..., None] + np.sqrt(variance)[..., None] * at
    value = log_likelihood(odds, data.failed[..., None], data.tests[:, None])  # type: ignore[index]
    return logsumexp(value, axis=-1, b=weight / weight.sum())


def data_of(measurements: Sequence[Measurement]) -> Data:
    """`Data` of one set of measurements."""
    n = np.array([m.n for m in measurements], float)
    value = np.array([m.value for m in measurements])
    lever = np.array([m.lever_error for m in measurements])
    error = np.hypot(stated_sd(measurements) / np.sqrt(n), lever)
    shared = shared_of(measurements, error, spread_unit(measurements))
    group = np.unique([m.experiment for m in measurements], return_inverse=True)[1]
    return Data(value[None], error[None], shared=shared, group=group)
