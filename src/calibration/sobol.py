"""Sobol indices of a function over the unit box, estimated as by Saltelli et al. (2010, Computer
Physics Communications 181:259, table 2, b and f): from two sets of points A and B of a scrambled
Sobol sequence, and sets AB that have one column of B in A."""

import numpy as np
from scipy.stats import norm, qmc

from calibration.errors import CalibrationError

SAMPLES, RESAMPLES = 4096, 100


def sobol_indices(emulator, names, seed=1):
    """First-order and total Sobol indices of the emulated mean over the box, with 95 % half widths
    by the bootstrap.

    emulator: a function of u (k, d) that gives (k,). Returns {name: {first, first_half, total,
    total_half}}. Raises CalibrationError where the response is constant.
    """
    d = len(names)
    points = qmc.Sobol(2 * d, seed=seed).random(SAMPLES)
    a, b = points[:, :d], points[:, d:]
    mixed = [np.where(np.arange(d) == k, b, a) for k in range(d)]
    u = np.stack([a, *mixed, b], axis=1).reshape(-1, d)
    y = np.asarray(emulator(u), float)
    if np.ptp(y) == 0.0:
        raise CalibrationError("the response is constant over the box; it has no Sobol indices")
    y = ((y - y.mean()) / y.std()).reshape(SAMPLES, d + 2)
    drawn = np.random.default_rng(seed).integers(SAMPLES, size=(SAMPLES, RESAMPLES))
    return {name: _of_one(y[:, 0], y[:, 1 + k], y[:, -1], drawn) for k, name in enumerate(names)}


def _of_one(a, ab, b, drawn):
    half = norm.ppf(0.975)
    first, total = _estimates(a, ab, b)
    firsts, totals = _estimates(a[drawn], ab[drawn], b[drawn])
    return {
        "first": float(first),
        "first_half": float(half * firsts.std(ddof=1)),
        "total": float(total),
        "total_half": float(half * totals.std(ddof=1)),
    }


def _estimates(a, ab, b):
    """First-order and total index of responses (n, ...) at A, AB and B."""
    variance = np.var(np.concatenate([a, b]), axis=0)
    first = (b * (ab - a)).mean(axis=0) / variance
    return first, 0.5 * ((a - ab) ** 2).mean(axis=0) / variance
