"""Checks of a joint posterior by simulation: ranks of simulation-based calibration, and coverage of
its intervals. The names follow those of `sbi.diagnostics`."""

import numpy as np
from scipy import stats

from calibration.inference.joint.critique import imagined
from calibration.inference.joint.likelihood import LEAST_WORTH, Cloud, worth


def simulation_based_calibration(joint, studies, draws=100, seed=1, cloud=None):
    """Ranks (studies, d) of parameters drawn from the prior among `draws` of the posterior of
    values that the model itself gives at them: uniform on 0 to `draws` where the posterior is right
    (Talts et al. 2018, arXiv:1804.06788)."""
    cloud, rng = cloud or Cloud.of(joint, seed=seed), np.random.default_rng(seed)
    truths = joint.prior.draw(studies, rng)
    values = imagined(joint, truths, rng)
    own = [cloud.draws(measured, draws, rng) for measured in values]
    return np.array([(u < truth).sum(axis=0) for u, truth in zip(own, truths, strict=True)])


def check_ranks(ranks, draws=100):
    """p values (d,) of the ranks (n, d) being uniform on 0 to `draws`, by Kolmogorov and Smirnov's
    test of the ranks made continuous."""
    rng = np.random.default_rng(0)
    even = (ranks + rng.random(ranks.shape)) / (draws + 1)
    return np.array([stats.kstest(column, "uniform").pvalue for column in even.T])


def coverage(joint, truths, measured, level=0.95, cloud=None, seed=1):
    """Share (d,) of truths (n, d), drawn from the prior, that lie in the central interval of their
    parameter. measured: what was measured at each, n `Joint`s or lists of one number a response."""
    cloud, rng = cloud or Cloud.of(joint, seed=seed), np.random.default_rng(seed)
    tail = 0.5 * (1.0 - level)
    pairs = zip(truths, measured, strict=True)
    below = np.array([_below(cloud, values, truth, rng) for truth, values in pairs])
    return ((below > tail) & (below < 1.0 - tail)).mean(axis=0)


def _below(cloud, values, truth, rng):
    """Posterior probability (d,) of each parameter lying below its truth."""
    joint = values if hasattr(values, "responses") else cloud.joint.at(values)
    own = Cloud(joint, cloud.u, cloud.predicted, cloud.formed)
    weights = own.weights([r.mean for r in joint.responses])
    if worth(weights) >= LEAST_WORTH:
        return weights @ (own.u < truth)
    draws = joint.posterior(int(rng.integers(2**31))).draws
    return (draws < truth).mean(axis=0)
