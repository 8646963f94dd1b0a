"""The test to make next: what each test of the laboratory is expected to tell per hour, of the
parameters or of what a machine will do."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

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


def expected_information(predicted: npt.ArrayLike, error_sd: npt.ArrayLike) -> float:
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
    predicted: npt.ArrayLike, error_sd: npt.ArrayLike, draws: npt.ArrayLike, seed: int = 1
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
