"""The test to make next: what each test of the laboratory is expected to tell per hour, of the
parameters or of what a machine will do; and which parameter a prediction's spread comes from, when
the parameters hang together."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from sklearn.linear_model import LinearRegression

from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.joint.critique import thinned

DRAWS = 400
SIGMAS, ENTROPY_GRID = 6.0, 2001
IMAGINED = 200  # outcomes of a measurement that are imagined


@dataclass(frozen=True)
class Candidate:
    """A test that could be made: rig and metric, its emulator, the readings it would take, its
    hours, and the standard deviation of a reading in the laboratory where it is known. Readings
    count with the larger of this and the runs' scatter."""

    rig: str
    metric: str
    emulator: object
    readings: int
    hours: float
    reading_sd: float = 0.0


@dataclass(frozen=True)
class Told:
    """What a candidate is expected to tell: information [nat] on the parameters or, where a
    prediction is wanted, on that; the same an hour; and shares (d,) of each parameter's standard
    deviation that are expected to remain, with that of the prediction (None without one)."""

    candidate: Candidate
    nat: float
    nat_per_hour: float
    left: np.ndarray
    prediction_left: float | None
    low: float
    high: float
    error: float


def rank(
    candidates: Iterable[Candidate], draws: np.ndarray, prediction: Any = None, seed: int = 1
) -> list[Told]:
    """`Told` of each candidate, that with the most information an hour first.

    draws: u (k, d) of the posterior. prediction: emulator of the machine's metric; without it the
    information is that on all parameters. Information on a prediction is that of a normal one,
    -log of the share of its standard deviation that is expected to remain.
    """
    u = thinned(draws, DRAWS)
    wanted = None if prediction is None else prediction.mean(u)[0]
    found = [_told(c, u, wanted, seed) for c in candidates]
    return sorted(found, key=lambda t: -t.nat_per_hour)


def _told(candidate, u, wanted, seed):
    mean, variance = candidate.emulator.mean(u)
    reading = np.maximum(candidate.emulator.sd_of_run(u), candidate.reading_sd)
    error = np.sqrt(variance + reading**2 / candidate.readings)
    # a deterministic test has no scatter and an emulator that knows a run has no error there
    error = np.maximum(error, 1e-6 * max(np.abs(mean).max(), 1e-12))
    known = u if wanted is None else np.column_stack([u, wanted])
    left = expected_spread(mean, error, known, seed) / np.maximum(known.std(axis=0), 1e-300)
    left = np.minimum(left, 1.0)
    if wanted is None:
        nat, of_prediction = expected_information(mean, error), None
    else:
        left, of_prediction = left[:-1], float(left[-1])
        nat = -float(np.log(max(of_prediction, 1e-12)))
    low, high = np.quantile(mean, [0.025, 0.975])
    return Told(
        candidate, nat, nat / candidate.hours, left, of_prediction, float(low), float(high),
        float(np.sqrt(np.mean(error**2))),
    )  # fmt: skip


def expected_information(predicted: ArrayLike, error_sd: ArrayLike) -> float:
    """Information [nat] that a measurement is expected to give of the parameters.

    predicted: (n,) its expected values at draws of the posterior; error_sd: (n,) or one standard
    deviation of its error there. It is the entropy of what could be measured less that of the error
    (Lindley 1956, Annals of Mathematical Statistics 27:986); both are computed, the first of the
    mixture on a grid.
    """
    predicted = np.asarray(predicted, float)
    sd = np.broadcast_to(np.asarray(error_sd, float), predicted.shape)
    low, high = (predicted - SIGMAS * sd).min(), (predicted + SIGMAS * sd).max()
    points = max(ENTROPY_GRID, int(4 * (high - low) / sd.min()) + 1)
    grid = np.linspace(low, high, points)
    density = np.mean([stats.norm.pdf(grid, m, s) for m, s in zip(predicted, sd, strict=True)], 0)
    logs = np.log(np.where(density > 0.0, density, 1.0))
    entropy = -np.trapezoid(density * logs, grid)
    return float(max(entropy - np.mean(0.5 * np.log(2.0 * np.pi * np.e * sd**2)), 0.0))


def expected_spread(
    predicted: ArrayLike, error_sd: ArrayLike, draws: ArrayLike, seed: int = 1
) -> np.ndarray:
    """Standard deviation (d,) that each parameter is expected to have after a measurement.

    predicted, error_sd: as of `expected_information`; draws: (n, d) of the posterior. Outcomes are
    imagined at draws taken in turn, and all draws weighed by what each outcome says of them; the
    variances are averaged (Lindley 1956).
    """
    predicted, draws = np.asarray(predicted, float), np.asarray(draws, float)
    sd = np.broadcast_to(np.asarray(error_sd, float), predicted.shape)
    rng = np.random.default_rng(seed)
    pick = np.linspace(0, len(predicted) - 1, min(IMAGINED, len(predicted))).astype(int)
    outcomes = rng.normal(predicted[pick], sd[pick])
    variances = []
    for y in outcomes:
        log = -0.5 * ((y - predicted) / sd) ** 2 - np.log(sd)
        weight = np.exp(log - log.max())
        mean = np.average(draws, axis=0, weights=weight)
        variances.append(np.average((draws - mean) ** 2, axis=0, weights=weight))
    return np.sqrt(np.mean(variances, axis=0))


TERMS = 3
"""Degree of the polynomial in one parameter by which the mean given this parameter is found."""


def shares(predicted: ArrayLike, draws: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """(first (d,), alone (d,)) shares of the variance of `predicted` (k,) over draws u (k, d).

    first: share that goes if the parameter became known, whatever hangs together with it (first
    Sobol index of dependent inputs); alone: share that no other parameter explains (total index):
    Kucherenko, Tarantola, Annoni 2012, Computer Physics Communications 183:937. Both by regression
    on polynomials of the draws. Shares of dependent parameters do not add up to 1.
    """
    y, u = np.asarray(predicted, float), np.asarray(draws, float)
    d, whole = u.shape[1], np.asarray(predicted, float).var()
    if whole == 0.0:
        return np.zeros(d), np.zeros(d)
    powers = [_powers(u[:, [k]]) for k in range(d)]
    every = _explained(np.hstack([*powers, _products(u)]), y)
    first = np.array([_explained(p, y) for p in powers])
    alone = np.empty(d)
    for k in range(d):
        rest = [j for j in range(d) if j != k]
        columns = [powers[j] for j in rest] + ([_products(u[:, rest])] if len(rest) > 1 else [])
        alone[k] = every - (_explained(np.hstack(columns), y) if columns else 0.0)
    return np.clip(first, 0.0, 1.0), np.clip(alone, 0.0, 1.0)


def _powers(x):
    z = (x - x.mean()) / (x.std() or 1.0)
    return np.hstack([z**p for p in range(1, TERMS + 1)])


def _products(u):
    z = (u - u.mean(axis=0)) / np.where(u.std(axis=0) > 0.0, u.std(axis=0), 1.0)
    i, j = np.triu_indices(u.shape[1], 1)
    return z[:, i] * z[:, j]


def _explained(terms, y):
    """Share of the variance of y (k,) that a regression on terms (k, t) explains, corrected for
    their number."""
    k, t = terms.shape
    share = LinearRegression().fit(terms, y).score(terms, y)
    return 1.0 - (1.0 - share) * (k - 1) / max(k - t - 1, 1)


def pushed(
    emulator: GaussianProcess, draws: np.ndarray, seed: int = 1
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(u (k, d), means (k,), single runs (k,)) that draws expect, the emulator's error in both and
    the seeds' scatter in the second."""
    u, rng = thinned(draws), np.random.default_rng(seed)
    mean, variance = emulator.mean(u)
    many = rng.normal(mean, np.sqrt(variance))
    return u, many, rng.normal(many, emulator.sd_of_run(u))
