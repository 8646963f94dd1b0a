"""How well errors of the set-up explain what the base model misses: a single setting that is off,
or an error of its own of every setting of an experiment.

Nothing else but a setting that is set anew tells such errors from a law, so they are its rivals. A
law is told from them by its odds. The base model is taken as linear about its mode, its parameters
and the sizes of the errors are integrated out.
"""

import numpy as np
from scipy.special import logsumexp

from diagnosis.extend import information
from diagnosis.fit import Data, Fit, misfit
from diagnosis.model import Model

ONE, EVERY = "one setting", "every setting"

SIZES = np.geomspace(0.5, 30.0, 12)
"""Standard deviations of such an error over that of its setting that are alike probable."""


def log_evidence(model: Model, data: Data, fitted: Fit) -> np.ndarray:
    """Log evidence (b,) of a model from its fits to b data sets, up to what all models share: its
    parameters are integrated out (Laplace's approximation: MacKay 2003, Information Theory,
    Inference and Learning Algorithms, 27)."""
    slope, known = _linear(model, data, fitted)
    curved = slope.swapaxes(1, 2) @ np.linalg.solve(known, slope)
    curved += np.diag(1.0 / model.prior_sd**2) + information(model, data, fitted.theta)
    volume = np.linalg.slogdet(curved)[1] + 2.0 * np.log(model.prior_sd).sum()
    return -0.5 * (misfit(model, data, fitted.theta) + volume)


def _linear(model, data, fitted):
    """Slopes (b, n, p) and covariances (b, n, n) of the readings at the modes, in their
    deviations."""
    slope = model.with_slope(fitted.theta, errors=False)[2] / fitted.sd[:, :, None]
    known = np.tile(np.eye(fitted.sd.shape[1]), (len(slope), 1, 1))
    if data.shared is not None:
        own = data.shared.covariance[fitted.sizes.argmax(1)]
        known += own / (fitted.sd[:, :, None] * fitted.sd[:, None, :])
    return slope, known


def set_up_errors(model: Model, data: Data, fitted: Fit) -> dict[str, float]:
    """{ONE, EVERY: gain in log evidence over the base model} of the first data set.

    fitted: the base model's `Fit`. Of a test that ends without a value, its deviance counts."""
    sd, (slope, known) = fitted.sd[0], (v[0] for v in _linear(model, data, fitted))
    off = (data.value[0] - fitted.predicted[0]) / sd
    off += slope @ (fitted.theta[0] - model.prior_mean)
    known = known + (slope * model.prior_sd**2) @ slope.T
    plain = _density(off, known)
    places = np.eye(len(sd))
    group = np.zeros(len(sd)) if data.group is None else data.group
    kinds = np.array([group == g for g in np.unique(group)], float)
    ones = _gains(off, known, places) - plain
    price = -np.log(np.mean(1.0 / np.hypot(1.0, SIZES)))  # of an error of its own
    ones = np.append(ones, 0.5 * fitted.deviances[0] - price)
    return {
        ONE: float(logsumexp(ones) - np.log(len(ones))),
        EVERY: float(logsumexp(_gains(off, known, kinds) - plain) - np.log(len(kinds))),
    }


def _gains(off, known, rows):
    """Log densities (k,) with an error at the settings of each of rows (k, n), over its sizes."""
    out = [[_density(off, known + np.diag(s**2 * own)) for s in SIZES] for own in rows]
    return logsumexp(out, axis=1) - np.log(len(SIZES))


def _density(off, covariance):
    """Log density of residuals (n,), up to what all covariances share."""
    return -0.5 * (off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1])
