"""A posterior that criticises itself: pulls of the targets, targets that contradict each other,
borders that it presses on, and whether its model can give what was measured at all.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import stats

from calibration.inference.joint.likelihood import Cloud, Joint, least_misfit
from calibration.inference.posterior_sampling import Prior

ALPHA = 0.05
"""Chance at which targets that agree are said to contradict each other."""
AGAIN = 400
"""Sets of measured values that are imagined, to judge the misfit by."""
NO_MISFIT = 0.1
"""Sum of squared pulls below which targets agree, whatever else would agree better."""
POINTS = 2000
EDGE = 0.1
"""Outermost share of the region at a side that counts as its border."""
PRESSED = 3.0
"""How many times its prior share a posterior has there when it presses on the border."""


def pulls(cloud: Cloud, draws: np.ndarray, seed: int = 1) -> list[dict[str, Any]]:
    """Each response of a study's `Cloud`, which gives the posteriors without one response, against
    what is predicted of it. draws: (k, d) of the posterior.

    measured; predicted: mean of the posterior of all targets; sd: that of their difference, the
    emulator's error in it; pull: the difference over it; p: two-sided, of the posterior predictive.
    pull_others, p_others: the same by the posterior of all other targets, which has not seen this.
    """
    found = []
    for r in cloud.joint.responses:
        mean, sd, pull, p = _against(r, thinned(draws))
        *_, apart, p_apart = _against(r, thinned(_draws_without(cloud, r.name, seed)))
        row = {"response": r.name, "measured": r.mean, "predicted": mean, "sd": sd, "pull": pull}
        found.append(row | {"p": p, "pull_others": apart, "p_others": p_apart})
    return found


def thinned(draws: np.ndarray, count: int = POINTS) -> np.ndarray:
    """At most `count` rows, evenly through draws (k, d)."""
    return draws[np.linspace(0, len(draws) - 1, min(count, len(draws))).astype(int)]


def _draws_without(cloud, name, seed):
    measured = [r.mean for r in cloud.joint.responses]
    if len(measured) == 1 and not cloud.joint.formed:
        return cloud.u
    return cloud.draws(measured, POINTS, np.random.default_rng(seed), but=name)


def _against(response, u):
    """(predicted mean, sd, pull, two-sided p) of a response against the mixture of its predictions
    at u (k, d)."""
    (mean, variance), own, y = response.predicted(u), response.variance, response.mean
    sd = np.sqrt(variance + own)
    spread = float(np.sqrt(np.mean(sd**2) + mean.var()))
    standard = (y - mean) / sd
    # of few readings the tails are Student's, with the degrees of freedom of a sum of variances of
    # which `own` alone is estimated (Welch and Satterthwaite)
    known, freedom = not np.isfinite(response.freedom), response.freedom * (sd**2 / own) ** 2
    law = stats.norm if known else stats.t(freedom)
    below = float(np.mean(law.cdf(standard)))
    centre = float(mean.mean())
    return centre, spread, float((y - centre) / spread), 2.0 * min(below, 1.0 - below)


def agreement(cloud: Cloud, draws: np.ndarray, seed: int = 1) -> dict[str, Any]:
    """Whether one set of parameters meets all targets of a study's `Cloud`, which gives the
    posteriors without one response. draws: (k, d) of its posterior.

    misfit: least sum of squared pulls; p: how often sets of values that agree misfit as much;
    named: responses of which leaving out any one lets the others agree, the best first; where none
    does, the one that helps most; p_without: {name: p of the others}; contradicts: whether the
    targets contradict each other.

    The least misfit over draws of the posterior and of the prior is compared with that of values
    drawn anew at the posterior: a parametric bootstrap of the goodness of fit (Efron and Tibshirani
    1993, chapter 16), which counts the freedom that the parameters really have.
    """
    joint, without, left = cloud.joint, {}, {}
    misfit, p = _goodness(joint, draws, seed)
    found = {"misfit": misfit, "p": p, "named": [], "p_without": {}, "contradicts": p < ALPHA}
    if p >= ALPHA:
        return found
    if len(joint.responses) < 2:
        return found | {"named": joint.names}
    for name in joint.names:
        own = _draws_without(cloud, name, seed)
        left[name], without[name] = _goodness(joint.without(name), own, seed)
    good = sorted((n for n in without if without[n] >= ALPHA), key=lambda n: left[n])
    named = good or [min(left, key=left.__getitem__)]
    return found | {"named": named, "p_without": without}


def _goodness(joint, draws, seed):
    """Least misfit of the measured values, and the share of imagined ones that misfit as much."""
    rng = np.random.default_rng(seed)
    own = thinned(draws)
    u = np.concatenate([own, joint.prior.draw(POINTS, rng)])
    predicted = joint.predicted(u)
    misfit = float(least_misfit(joint, [np.array([r.mean]) for r in joint.responses], predicted)[0])
    pick = rng.integers(0, len(own), AGAIN)
    again = [
        r.drawn(mean[pick], variance[pick], rng)
        for r, (mean, variance) in zip(joint.responses, predicted, strict=True)
    ]
    imagined = least_misfit(joint, again, predicted)
    if misfit < NO_MISFIT:
        return misfit, 1.0
    return misfit, float((1 + np.sum(imagined >= misfit)) / (AGAIN + 1))


def borders(draws: np.ndarray, prior: Prior) -> dict[int, tuple[str, float]]:
    """{index: (side, "low" or "high", and how far beyond it the region would have to reach, as a
    share of its width)} of the parameters of draws u (k, d) in [0, 1]^d that press on a border:
    with at least three times the prior's share in the outermost tenth of a side, and more than at
    the other side.

    A density that is flat or falls towards the border gives none. `beyond` is the distance at which
    an exponential tail with the median distance of the draws has fallen to 5 %.
    """
    before, found = prior.draw(20000, np.random.default_rng(1)), {}
    for k in range(draws.shape[1]):
        for side in ("low", "high"):
            own, other = (x[:, k] if side == "low" else 1.0 - x[:, k] for x in (draws, before))
            share, prior_share = (float(np.mean(x <= EDGE)) for x in (own, other))
            if share >= PRESSED * max(prior_share, 0.01) and share > np.mean(own >= 1.0 - EDGE):
                beyond = np.log(20.0) / np.log(2.0) * np.median(own)
                found[k] = side, float(min(beyond, 1.0))
    return found


def imagined(joint: Joint, u: np.ndarray, rng: np.random.Generator) -> list[Sequence[Any]]:
    """Measured values at u (k, d) as the model gives them: k lists with one a response."""
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
    values = imagined(joint, joint.prior.draw(studies, rng), rng)
    found = np.array([_log_evidence(cloud, v) for v in values])
    return float((1 + np.sum(found <= given)) / (studies + 1))


def _log_evidence(cloud, measured):
    log = cloud.log_likelihood(measured)
    return float(log.max() + np.log(np.mean(np.exp(log - log.max()))))
