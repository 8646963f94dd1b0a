"""Likelihoods and held-out scores of linear mixed models over a grid of their variances, for many
data sets at once.

z = mean + level + law + shared errors + noise, all Gaussian. The law is a Gaussian process over its
state, or one of a family of curves. Errors between settings, between batches and instruments, and
between the levels of a lever each have a standard deviation. It is estimated by maximum posterior
on a grid (the prior is half Cauchy in units of the measurements' error). With P the inverse
covariance, a fold G is predicted from the rest with covariance (P_GG)^-1 and residual (P_GG)^-1 (P
z)_G: Rasmussen and Williams (2006), Gaussian Processes for Machine Learning, 5.4.2.
"""

from dataclasses import dataclass, replace

import numpy as np

from diagnosis.fit import redrawn_share
from diagnosis.laws.sizes import combined

LEVEL_SD = 1.5  # prior sd of the level's logarithm
JITTER = 1e-10
REST = 1e-6


@dataclass(frozen=True)
class Nuisance:
    """Grid of the shared errors: covariance (g, n, n), log prior (g,), and the sds of each {name:
    (g,)}."""

    covariance: np.ndarray
    prior: np.ndarray
    sds: dict


def nuisance_of(readings):
    """`Nuisance` of readings; at most two kinds of shared errors at once."""
    n = len(readings.log)
    unit = float(np.median(readings.error))
    kinds = {"settings": np.eye(n)}
    for name, code in readings.groups.items():
        kinds[name] = (code[:, None] == code[None, :]).astype(float)
    names = list(kinds)
    choices, prior = combined(names)
    noise = np.diag(readings.error**2)
    covariance = np.array(
        [noise + sum((unit * t) ** 2 * kinds[k] for k, t in c.items()) for c in choices]
    )
    sds = {k: np.array([unit * c.get(k, 0.0) for c in choices]) for k in names}
    return Nuisance(covariance, prior, sds)


@dataclass(frozen=True)
class Candidate:
    """One law to be tried, in the space where it is linear.

    space: "log", "linear" or "angle" (see `to_space`). covariance: (h, n, n) of the law at h
    smoothnesses, with log prior (h,); mean: (k, n) curves, one of which holds, with log prior (k,).
    label says what a k is.
    """

    name: str
    slot: str
    state: tuple
    space: str
    covariance: np.ndarray
    prior: np.ndarray
    mean: np.ndarray
    mean_prior: np.ndarray
    label: np.ndarray
    catalogue: bool = False
    free: bool = False
    level: float = LEVEL_SD


def to_space(space, log, centre):
    """z (..., n) and dz/dlog in the space of a candidate, of logarithms less `centre`.

    log: the logarithm itself; linear: the reading over its centre, less 1; angle: the sliding angle
    over its centre."""
    rest = log - centre
    if space == "log":
        return rest, np.ones_like(rest)
    if space == "linear":
        y = np.exp(rest)
        return y - 1.0, y
    angle, middle = np.arctan(np.exp(log)), np.arctan(np.exp(centre))
    return angle / middle - 1.0, 0.5 * np.sin(2.0 * angle) / middle


@dataclass(frozen=True)
class Fitted:
    """Of r data sets: likelihood and held-out score (r,) in the space of the logarithms, by_fold
    {lever: (r, levels)}, and the best places (r,) on the grids of nuisance, smoothness and
    curve."""

    likelihood: np.ndarray
    score: np.ndarray
    nuisance: np.ndarray
    smooth: np.ndarray
    curve: np.ndarray
    by_fold: dict


def evaluate(candidate, readings, nuisance, log, centre, folds=None):
    """`Fitted` of the candidate to data sets of logarithms (r, n); the spread is that at their
    mean."""
    z, slope = to_space(candidate.space, log, centre)
    precision, logdet = _precisions(candidate, nuisance, slope.mean(0))
    shape = len(nuisance.prior), len(candidate.prior)
    jacobian = np.log(np.abs(slope)).sum(1)
    value = _densities(candidate, nuisance, z, precision, logdet)
    flat = value.reshape(-1, len(z))
    best = flat.argmax(0)
    grid, curve = np.divmod(best, len(candidate.mean))
    left = z - candidate.mean[curve]
    score, by_fold = _held_out(precision, left, slope, grid, folds or readings.folds)
    constant = jacobian - 0.5 * z.shape[1] * np.log(2.0 * np.pi)
    place = np.unravel_index(grid, shape)
    likelihood = flat[best, np.arange(len(z))] + constant
    return Fitted(likelihood, score, place[0], place[1], curve, by_fold)


def _densities(candidate, nuisance, z, precision, logdet):
    """Log densities (g, k, r) of z (r, n) at every place of the grid and with every curve, priors
    included, up to a constant."""
    prior = (nuisance.prior[:, None] + candidate.prior[None, :]).ravel()
    quadratic = (z.T * (precision @ z.T)).sum(1)
    pm = candidate.mean @ precision  # (g, k, n)
    own = (pm * candidate.mean).sum(2)
    value = -0.5 * (quadratic[:, None] - 2.0 * pm @ z.T + own[..., None] + logdet[:, None, None])
    return value + prior[:, None, None] + candidate.mean_prior[None, :, None]


def profile(candidate, readings, nuisance, log, centre):
    """Log likelihood (k,) of one data set, log (1, n), with each of the candidate's curves at the
    best variances for that curve, up to a constant."""
    return _at_each(candidate, nuisance, log, centre).max(0)[:, 0]


def _at_each(candidate, nuisance, log, centre):
    """Log densities (g, k, r) of data sets (r, n) at each place of the grid."""
    z, slope = to_space(candidate.space, log, centre)
    precision, logdet = _precisions(candidate, nuisance, slope.mean(0))
    return _densities(candidate, nuisance, z, precision, logdet)


def _precisions(candidate, nuisance, weight):
    """(g, n, n) inverse covariances and (g,) log determinants, nuisance outermost."""
    shared = nuisance.covariance * (weight[:, None] * weight[None, :])
    own = candidate.covariance + candidate.level**2
    total = (shared[:, None] + own[None, :]).reshape(-1, *own.shape[1:])
    total = total + JITTER * np.eye(total.shape[1])
    return np.linalg.inv(total), np.linalg.slogdet(total)[1]


def _held_out(precision, z, slope, grid, folds):
    """Score (r,): mean over levers of the log densities of whole levels, each predicted from the
    others."""
    by_fold = {lever: np.zeros((len(z), len(levels))) for lever, levels in folds.items()}
    for g in np.unique(grid):
        rows = np.flatnonzero(grid == g)
        p = precision[g]
        pz = z[rows] @ p
        for lever, levels in folds.items():
            for k, index in enumerate(levels):
                inner = p[np.ix_(index, index)]
                # -1/2 e' P_GG e with e = P_GG^-1 (P z)_G
                part = pz[:, index]
                square = np.einsum("ri,ri->r", part, np.linalg.solve(inner, part.T).T)
                density = 0.5 * np.linalg.slogdet(inner)[1] - 0.5 * square
                density += np.log(np.abs(slope[rows][:, index])).sum(1)
                by_fold[lever][rows, k] = density - 0.5 * len(index) * np.log(2.0 * np.pi)
    score = sum(v.sum(1) for v in by_fold.values()) / max(len(by_fold), 1)
    return score, by_fold


def posterior(candidate, readings, nuisance, fitted, log, centre, row=0):
    """Mean (n,) and covariance (n, n) of level and law together at the settings, in the candidate's
    space."""
    z, slope = to_space(candidate.space, log[row], centre)
    shared = nuisance.covariance[fitted.nuisance[row]] * (slope[:, None] * slope[None, :])
    own = candidate.covariance[fitted.smooth[row]] + candidate.level**2
    gain = own @ np.linalg.inv(own + shared + JITTER * np.eye(len(z)))
    mean = candidate.mean[fitted.curve[row]]
    return mean + gain @ (z - mean), own - gain @ own


def draw(candidate, nuisance, fitted, log, centre, readings, replicates, rng):
    """Data sets (replicates, n) of logarithms: what the fit says, with shared errors and noise
    drawn anew.

    Neither is known: how large the shared errors are is drawn from what the readings say of it, and
    the noise is that over a spread which the replicates find."""
    mean, _ = posterior(candidate, readings, nuisance, fitted, log, centre)
    smooth = from_space(candidate.space, mean, centre)
    h, k = fitted.smooth[:1], fitted.curve[:1]
    as_fitted = replace(
        candidate,
        covariance=candidate.covariance[h],
        prior=candidate.prior[h],
        mean=candidate.mean[k],
        mean_prior=candidate.mean_prior[k],
    )
    share = shares(as_fitted, nuisance, log[:1], centre)[:, 0]
    place = rng.choice(len(share), replicates, p=share)
    return smooth + errors_at(place, nuisance, readings, rng)


def shares(candidate, nuisance, log, centre):
    """Probabilities (g, r) of the sizes of the shared errors, of data sets of logarithms (r, n).

    The candidate has one smoothness and one curve."""
    value = _at_each(candidate, nuisance, log, centre)[:, 0]
    share = np.exp(value - value.max(0))
    return share / share.sum(0)


def errors_at(place, nuisance, readings, rng):
    """Errors (r, n) of logarithms, shared ones and noise, drawn at places (r,) of the grid."""
    noise, size = np.diag(readings.error**2), (len(place), len(readings.error))
    shared = rng.standard_normal(size)
    for g in np.unique(place):
        # the rest of the noise makes the root one that exists, and the same everywhere
        root = np.linalg.cholesky(nuisance.covariance[g] - (1.0 - REST) * noise)
        shared[place == g] = shared[place == g] @ root.T
    own = readings.error * rng.standard_normal(size)
    return shared + own / redrawn_share(readings.replicates, len(place), rng)


def from_space(space, z, centre):
    """Logarithms of z in a candidate's space; the inverse of `to_space`."""
    if space == "log":
        return centre + z
    if space == "linear":
        return centre + np.log(np.maximum(1.0 + z, 1e-6))
    middle = np.arctan(np.exp(centre))
    return np.log(np.tan(np.clip(middle * (1.0 + z), 1e-6, 1.56)))
