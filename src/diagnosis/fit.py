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
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logsumexp, xlogy
from scipy.stats import chi2

from calibration.no_value import log_likelihood
from calibration.quantities import QUANTITIES
from diagnosis.failures import outcomes_of

STARTS = (0.2, 0.7)
DESCENTS = 2
ITERATIONS = 14  # of a descent, at most
SETTLED = 1e-3  # fall of twice the negative log posterior below which a fit has settled
NODES = 21  # of the quadrature over the odds of a test
PRIOR = 8.0  # degrees of freedom that the common spread weighs
STUCK = 1e6  # damping at which no step helps any more


@dataclass(frozen=True)
class Data:
    """b data sets of n conditions: means and their standard errors (b, n), without the emulators'
    share; of `tests` (c,) under the model's further conditions `failed` (b, c) gave no value."""

    value: np.ndarray
    error: np.ndarray
    failed: np.ndarray | None = None
    tests: np.ndarray | None = None

    def of(self, rows):
        """The data sets `rows` (m,)."""
        failed = None if self.failed is None else self.failed[rows]
        return Data(self.value[rows], self.error[rows], failed, self.tests)


@dataclass(frozen=True)
class Fit:
    """theta (b, p); cov (b, p, p); predicted, residual (in units of sd), sd, leverage (b, n);
    scale, score (b,).

    pointwise: held-out log densities (b, n), those of tests without a value behind them (b, n + c);
    deviances: of the tests (b, c), chi-squares for many tests of a condition."""

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

    @property
    def misfit(self):
        """Chi-square and deviances (b,) together."""
        return self.chi_square + self.deviances.sum(1)

    @property
    def score(self):
        """Sum of the held-out log densities (b,)."""
        return self.pointwise.sum(1)


def fit(model, data, starts=STARTS):
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
    return _summary(model, data, modes[0] if len(modes) == 1 else _best(model, data, modes))


def _best(model, data, modes):
    """Of several modes (b, p) the one of each data set that fits best."""
    costs = [misfit(model, data, theta) for theta in modes]
    return np.stack(modes)[np.argmin(costs, axis=0), np.arange(len(data.value))]


def _sd(data, emulator):
    return np.sqrt(data.error**2 + emulator**2)


def misfit(model, data, theta):
    """Twice the negative log posterior (b,), up to a constant, with the spread at theta itself."""
    value, emulator = model.predict(theta)
    sd = _sd(data, emulator)
    return _cost(model, data, theta, value, sd) + 2.0 * np.log(sd).sum(1)


def _cost(model, data, theta, value, sd):
    """The same with a given spread."""
    r = (data.value - value) / sd
    q = (theta - model.prior_mean) / model.prior_sd
    cost = (r * r).sum(1) + (q * q).sum(1)
    if data.failed is None:
        return cost
    odds, _ = model.odds(theta, slope=False)
    return cost - 2.0 * log_likelihood(odds, data.failed, data.tests).sum(1)


def _descend(model, data, theta):
    """Modes (b, p) from starts (b, p), the spread held; a data set that has settled is left
    alone."""
    theta = theta.copy()
    value, emulator, slope = model.with_slope(theta)
    sd, damping = _sd(data, emulator), np.full(len(theta), 1e-2)
    cost = _cost(model, data, theta, value, sd)
    moving = np.arange(len(theta))
    for _ in range(ITERATIONS):
        own = data.of(moving)
        scaled = slope[moving] / sd[moving][:, :, None]
        trial = _step(model, own, theta[moving], value[moving], scaled, sd[moving], damping[moving])
        there, _, slope_there = model.with_slope(trial, errors=False)
        after = _cost(model, own, trial, there, sd[moving])
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


def _covariance(model, j):
    return np.linalg.inv(_curvature(model, j))


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


def _step(model, data, theta, value, j, sd, damping):
    """Where a damped Gauss-Newton step leads, within the bounds."""
    j, r = _with_tests(model, data, theta, j, (data.value - value) / sd)
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
    sd = _sd(data, emulator)
    n = value.shape[1]
    j, r = _with_tests(model, data, theta, slope / sd[:, :, None], (data.value - value) / sd)
    # a parameter that is held at its bound does not follow when a setting is left out
    moves = j * ~_held(model, theta, _gradient(model, theta, j, r))[:, None, :]
    leverage = np.einsum("bnp,bpq,bnq->bn", moves, _covariance(model, moves), moves)
    leverage = leverage.clip(0.0, 0.9999)
    tested, deviances = _of_tests(model, data, theta, r[:, n:], leverage[:, n:])
    r, leverage = r[:, :n], leverage[:, :n]
    chi = (r * r).sum(1)
    freedom = np.maximum(r.shape[1] - leverage.sum(1), 1.0)
    scale = np.sqrt(np.maximum(chi / freedom, 1.0))
    left = 1.0 - leverage
    spread = scale[:, None] * sd / np.sqrt(left)
    pointwise = -0.5 * (r * sd / left / spread) ** 2 - np.log(spread) - 0.5 * np.log(2.0 * np.pi)
    pointwise = np.concatenate([pointwise, tested], 1)
    cov = _covariance(model, j)
    return Fit(theta, cov, value, r, sd, leverage, chi, freedom, scale, pointwise, deviances)


def _of_tests(model, data, theta, r, leverage):
    """Held-out log probabilities (b, c) of the tests, and their deviances."""
    if data.failed is None:
        return np.zeros((len(theta), 0)), np.zeros((len(theta), 0))
    odds, _ = model.odds(theta, slope=False)
    chance = expit(odds)
    root = np.sqrt(np.maximum(data.tests * chance * (1.0 - chance), 1e-12))
    # what the others say of the odds: their mean and variance without the test
    variance = leverage / (1.0 - leverage) / root**2
    score = held_out(odds - variance * root * r, variance, data)
    share = data.failed / data.tests
    best = data.tests * (xlogy(share, share) + xlogy(1.0 - share, 1.0 - share))
    at_mode = log_likelihood(odds, data.failed, data.tests)
    return score, 2.0 * (best - at_mode)


def held_out(mean, variance, data):
    """Log probability (b, c) of what the tests ended with, their odds' logarithms normal with mean
    and variance (b, c)."""
    at, weight = np.polynomial.hermite_e.hermegauss(NODES)
    odds = mean[..., None] + np.sqrt(variance)[..., None] * at
    value = log_likelihood(odds, data.failed[..., None], data.tests[:, None])
    return logsumexp(value, axis=-1, b=weight / weight.sum())


def spread_unit(measurements):
    """(n,) what spreads are compared in: the value where they go with it, else 1."""
    return np.array([m.value if QUANTITIES[m.experiment].relative else 1.0 for m in measurements])


def moderated_sd(measurements, own=None):
    """(..., n) standard deviations of a replicate, drawn towards the median of their experiment.

    own: (..., n) spreads of the replicates, those of the measurements unless given.

    Few replicates give a poor estimate of their own spread: s^2 = (d0 s0^2 + (n-1) s_i^2) / (d0 + n
    - 1), d0 = 8; Smyth (2004), Stat. Appl. Genet. Mol. Biol. 3:3. The spread is relative for drop
    and shear, absolute for angles. The median of spreads from few replicates lies below the true
    spread. So the median is taken of s_i over the median of its law."""
    unit = spread_unit(measurements)
    own = np.array([m.sd for m in measurements] if own is None else own) / unit
    freedom = np.maximum([m.n - 1.0 for m in measurements], 0.0)
    usual = _usual(freedom)
    common = np.empty(own.shape)
    for kind in {m.experiment for m in measurements}:
        rows = [i for i, m in enumerate(measurements) if m.experiment == kind]
        common[..., rows] = np.median(own[..., rows] / usual[rows], axis=-1, keepdims=True)
    return unit * _moderated(own, common, freedom)


def _usual(freedom):
    """Median (n,) of the spreads that so many degrees of freedom find, over the true one."""
    some = np.maximum(freedom, 1)
    # a spread given with a single value is no estimate from it
    return np.where(freedom > 0, np.sqrt(chi2.ppf(0.5, some) / some), 1.0)


def _moderated(own, common, freedom):
    return np.sqrt((PRIOR * common**2 + freedom * own**2) / (PRIOR + freedom))


def redrawn_error(measurements, error, replicates, rng):
    """Standard errors (replicates, n) that laboratories would state of readings whose true ones are
    `error` (n,): the spreads of their replicates drawn anew and moderated."""
    n = np.array([m.n for m in measurements], float)
    found = _found_spread(n, replicates, rng)
    return moderated_sd(measurements, error * np.sqrt(n) * found) / np.sqrt(n)


def redrawn_share(n, replicates, rng):
    """The same over the true ones, of one experiment's settings with n (k,) replicates whose
    spreads are alike."""
    found = _found_spread(n, replicates, rng)
    freedom = np.maximum(n - 1.0, 0.0)
    return _moderated(found, np.median(found / _usual(freedom), axis=-1, keepdims=True), freedom)


def _found_spread(n, replicates, rng):
    """Spreads (replicates, k) that n (k,) replicates find, over the true one."""
    freedom = np.maximum(n - 1.0, 1.0)
    draws = rng.chisquare(freedom, (replicates, len(n))) / freedom
    return np.where(n > 1, np.sqrt(draws), 1.0)


def data_of(measurements, tests=None):
    """`Data` of one set of measurements, and of `diagnosis.failures.Outcomes` beside them."""
    n = np.array([m.n for m in measurements], float)
    value = np.array([m.value for m in measurements])
    lever = np.array([m.lever_error for m in measurements])
    error = np.hypot(moderated_sd(measurements) / np.sqrt(n), lever)
    if tests is None:
        return Data(value[None], error[None])
    return Data(value[None], error[None], tests.failed[None], tests.tests)


def evidence(emulated, measurements):
    """What a fit of an `Emulated` to measurements takes, tests without a value among them: the
    measurements with a value, the conditions of the tests, and the `Data` of both."""
    tests = outcomes_of(measurements, emulated.failures)
    valued = [m for m in measurements if not m.outcome]
    return valued, tests.conditions if tests else (), data_of(valued, tests)
