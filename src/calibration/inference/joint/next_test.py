"""The test to make next: what each test of the laboratory is expected to tell per hour, of the
parameters or of what a machine will do."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.inference.information import expected_information, expected_spread
from calibration.inference.joint.critique import thinned

DRAWS = 400


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
