"""Checks of a joint posterior: ranks of simulation-based calibration, coverage of its intervals,
and whether the model can give what was measured.

The names follow those of `sbi.diagnostics`. Each is a function of a `Joint`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from calibration.inference.joint.likelihood import LEAST_WORTH, Cloud, Joint, worth


def simulation_based_calibration(
    joint: Joint, studies: int = 200, draws: int = 100, seed: int = 1, cloud: Cloud | None = None
) -> np.ndarray:
    """Ranks (studies, d) of parameters drawn from the prior among `draws` of the posterior of
    values that the model itself gives at them: uniform on 0 to `draws` where the posterior is right
    (Talts et al. 2018, arXiv:1804.06788)."""
    cloud, rng = cloud or Cloud.of(joint, seed=seed), np.random.default_rng(seed)
    truths = joint.prior.draw(studies, rng)
    values = _imagined(joint, truths, rng)
    ranks = np.empty(truths.shape, int)
    for n, measured in enumerate(values):
        own = cloud.draws(measured, draws, rng)
        ranks[n] = (own < truths[n]).sum(axis=0)
    return ranks


def check_ranks(ranks: np.ndarray, draws: int = 100) -> np.ndarray:
    """p values (d,) of the ranks (n, d) of simulation-based calibration being uniform on 0 to
    `draws`, by Kolmogorov and Smirnov's test of the ranks made continuous."""
    rng = np.random.default_rng(0)
    even = (ranks + rng.random(ranks.shape)) / (draws + 1)
    return np.array([stats.kstest(column, "uniform").pvalue for column in even.T])


@dataclass(frozen=True)
class Coverage:
    """Share (d,) of truths that lie in the central interval of their parameter, its standard error
    (d,), and the number of studies."""

    share: np.ndarray
    error: np.ndarray
    studies: int


def coverage(
    joint: Joint,
    truths: np.ndarray,
    measured: Sequence[Any],
    level: float = 0.95,
    cloud: Cloud | None = None,
    seed: int = 1,
) -> Coverage:
    """`Coverage` of the central intervals of `level`.

    truths: (n, d) parameters, drawn from the prior; measured: n lists of what was measured at each,
    one (q,) a response, or a `Joint` with errors of its own. Whoever gives values of the true
    response, not of the emulators, has the emulators' error in the check.
    """
    cloud, rng = cloud or Cloud.of(joint, seed=seed), np.random.default_rng(seed)
    tail = 0.5 * (1.0 - level)
    inside = np.empty(truths.shape, bool)
    for n, (truth, values) in enumerate(zip(truths, measured, strict=True)):
        below = _below(cloud, values, truth, rng)
        inside[n] = (below > tail) & (below < 1.0 - tail)
    share = inside.mean(axis=0)
    return Coverage(share, np.sqrt(share * (1.0 - share) / len(truths)), len(truths))


def _below(cloud, values, truth, rng):
    """Posterior probability (d,) of each parameter lying below its truth."""
    own = _with(cloud, values)
    measured = [r.mean for r in own.joint.responses]
    weights = own.weights(measured)
    if worth(weights) >= LEAST_WORTH:
        return weights @ (own.u < truth)
    draws = own.joint.posterior(int(rng.integers(2**31))).draws
    return (draws < truth).mean(axis=0)


def _with(cloud, values):
    """The cloud of a study with these values: a list of means, or a `Joint` of the same
    emulators."""
    joint = values if hasattr(values, "responses") else cloud.joint.at(values)
    return Cloud(joint, cloud.u, cloud.predicted, cloud.formed)


def _imagined(joint, u, rng):
    """Measured values at u (k, d) as the model gives them: k lists with one (q,) a response."""
    drawn = [r.drawn(*r.predicted(u), rng) for r in joint.responses]
    return list(zip(*drawn, strict=True))


def misspecification(joint: Joint, studies: int = 1000, seed: int = 1, size: int = 4000) -> float:
    """p of the measured values under the prior predictive: the share of values that the model gives
    anywhere in the region whose evidence is no larger than theirs.

    Small where no parameters of the region give what was measured, as `sbi`'s check by the log
    probability of the data does (Schmitt et al. 2023, arXiv:2112.08866, ask the same of summaries).
    """
    cloud, rng = Cloud.of(joint, size, seed), np.random.default_rng(seed)
    given = _log_evidence(cloud, [r.mean for r in joint.responses])
    values = _imagined(joint, joint.prior.draw(studies, rng), rng)
    found = np.array([_log_evidence(cloud, v) for v in values])
    return float((1 + np.sum(found <= given)) / (studies + 1))


def _log_evidence(cloud, measured):
    log = cloud.log_likelihood(measured)
    return float(log.max() + np.log(np.mean(np.exp(log - log.max()))))
