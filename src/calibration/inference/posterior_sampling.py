"""Priors, what runs without a value say, and the sampler of a posterior.

Coded parameters u lie in [0, 1]^d, the prior's box. Arrays in, arrays out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import emcee
import numpy as np
from scipy import stats

from calibration.inference.chance_of_no_value import Chance, log_likelihood

WALKERS, BURN, STEPS = 32, 300, 1200
ROUNDS = 4
"""Times `steps` that chains are run at most, with one kind of move."""
MOVES = (
    emcee.moves.StretchMove(),
    [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)],
)
"""Moves of the ensemble, one after the other until the chains are long enough. Stretches alone have
an autocorrelation time of 400 to 800 where eight factors fill their box to its corners; differences
of walkers (ter Braak and Vrugt 2008, Statistics and Computing 18:435) 100 there."""
AUTOCORRELATIONS = 25
"""Autocorrelation times that the chains must be long: below it emcee's estimate of them is not to
be trusted."""


@dataclass(frozen=True)
class Formed:
    """`tests` of the laboratory that all gave a value, and the `Chance` of a run that gives none.

    A run without a value has no number to be fitted; what is known of it is that the laboratory's
    tests did not end so."""

    chance: Chance
    tests: int

    def log_likelihood(self, u: np.ndarray) -> np.ndarray:
        """(k,) log probability that all tests give a value at u (k, d)."""
        odds, _ = self.chance.predict(np.atleast_2d(u))
        return log_likelihood(odds, 0, self.tests)


@dataclass(frozen=True)
class Prior:
    """Independent priors of u (d,) in [0, 1]: uniform, or where sd is finite normal about `mean`,
    cut to the box."""

    mean: np.ndarray
    sd: np.ndarray

    def log_density(self, u: np.ndarray) -> np.ndarray:
        """(k,) log density at u (k, d) but for a constant; -inf outside the box."""
        inside = ((u >= 0.0) & (u <= 1.0)).all(axis=1)
        return np.where(inside, -0.5 * (((u - self.mean) / self.sd) ** 2).sum(axis=1), -np.inf)

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """n draws (n, d)."""
        columns = []
        for mean, sd in zip(self.mean, self.sd, strict=True):
            if np.isinf(sd):
                columns.append(rng.random(n))
            else:
                cut = stats.truncnorm((0.0 - mean) / sd, (1.0 - mean) / sd, mean, sd)
                columns.append(cut.rvs(n, random_state=rng))
        return np.column_stack(columns)


@dataclass(frozen=True)
class Posterior:
    """Draws u (n, d), and how the sampler did: autocorrelation time, share accepted, and the number
    of independent draws they are worth."""

    draws: np.ndarray
    autocorrelation: float
    accepted: float
    effective: float

    @property
    def converged(self) -> bool:
        """Return whether the chains are long enough for their length to be judged."""
        return bool(self.effective >= AUTOCORRELATIONS * WALKERS)

    def interval(self, level: float) -> tuple[np.ndarray, np.ndarray]:
        """(low, high), (d,) each: the central interval of every parameter on its own."""
        tail = 0.5 * (1.0 - level)
        return np.quantile(self.draws, tail, axis=0), np.quantile(self.draws, 1.0 - tail, axis=0)


def sample(measured: Sequence[Any], prior: Prior, seed: int = 1, steps: int = STEPS) -> Posterior:
    """The posterior by emcee's affine-invariant ensemble (Foreman-Mackey et al. 2013, PASP
    125:306).

    measured: objects whose `log_likelihood(u)` gives (k,) at u (k, d). Chains that are too short
    for their autocorrelation are run on, to `ROUNDS` times `steps`, then anew with the next of
    `MOVES`; `converged` says whether that was enough.
    """
    d = len(prior.mean)

    def log_density(u: np.ndarray) -> np.ndarray:
        value = prior.log_density(u)
        inside = np.isfinite(value)
        if inside.any():
            value[inside] += sum(m.log_likelihood(u[inside]) for m in measured)
        return value

    rng = np.random.default_rng(seed)
    start = _starts(log_density, prior, rng)
    state = emcee.State(start, random_state=np.random.RandomState(seed).get_state())
    for moves in MOVES:
        sampler = emcee.EnsembleSampler(WALKERS, d, log_density, moves=moves, vectorize=True)
        state = sampler.run_mcmc(state, BURN)
        sampler.reset()
        time, enough = _run_on(sampler, state, steps)
        if enough:
            break
    time = max(time, 1.0) if np.isfinite(time) else float(sampler.iteration)
    thin = max(1, int(0.5 * time))
    draws, accepted = sampler.get_chain(flat=True, thin=thin), sampler.acceptance_fraction.mean()
    return Posterior(draws, time, float(accepted), sampler.iteration * WALKERS / time)


def _run_on(sampler, state, steps):
    """Run chains until they are long enough or `ROUNDS` have passed; (their autocorrelation time,
    whether they are)."""
    for _ in range(ROUNDS):
        state = sampler.run_mcmc(state, steps)
        time = float(np.max(sampler.get_autocorr_time(quiet=True, tol=0)))
        if enough := sampler.iteration >= AUTOCORRELATIONS * time:
            break
    return time, enough


def _starts(log_density, prior, rng):
    """Walkers (w, d) drawn from the prior in proportion to the likelihood, so that none begins far
    out."""
    candidates = prior.draw(200 * WALKERS, rng)
    value = log_density(candidates)
    weight = np.exp(value - value.max())
    keys = rng.random(len(weight)) ** (1.0 / np.maximum(weight, 1e-300))
    return candidates[np.argsort(-keys, kind="stable")[:WALKERS]]
