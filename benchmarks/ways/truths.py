"""Responses in closed form that stand for the engine: the truth is known, a run costs nothing.

Three factors in coded levels, [-1, 1]^3, as in a response surface of the chain. Each function
gives responses (n,) [deg] at coded points x (n, 3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

SEED_SD = 0.9
"""Scatter of heaps from seed to seed: that of the salt's validation, rounded [deg]."""
READINGS, READING_SD = 25, 0.8
"""The laboratory's readings, as in the paper's Table 1 [deg]."""
INSIDE = 0.8  # of the region's half width: where the truth is drawn


def nearly_plane(x: np.ndarray) -> np.ndarray:
    """Almost linear."""
    a, b, c = np.atleast_2d(x).T
    return 45.0 - 0.8 * a + 0.9 * b + 4.0 * c + 0.2 * c * c


def quadratic(x: np.ndarray) -> np.ndarray:
    """A full quadratic, as the chain's model assumes."""
    a, b, c = np.atleast_2d(x).T
    return (
        45.0 - 0.6 * a + 1.0 * b + 4.0 * c - 0.7 * a * c + 0.6 * b * c + 1.0 * c * c + 0.5 * a * a
    )


def saturating(x: np.ndarray) -> np.ndarray:
    """Rises and levels off, as an angle does over rolling friction; no quadratic."""
    a, b, c = np.atleast_2d(x).T
    return (
        48.0 - 5.5 * np.exp(-1.3 * (1.0 + c)) * (1.0 + 0.15 * a) + 0.8 * b - 1.0 * a * (c > 0) * c
    )


STEP = 3.0
"""By how much a response jumps, and heaps of two kinds differ: those out of a funnel that packs
are 3.1 degrees steeper in the rig as printed [deg]."""


def stepped(x: np.ndarray) -> np.ndarray:
    """A plane with a jump across the region."""
    a, b, c = np.atleast_2d(x).T
    return 43.5 - 0.8 * a + 0.9 * b + 2.5 * c + STEP * (c > 0.1 + 0.3 * a)


def packed(x: np.ndarray) -> np.ndarray:
    """In place of responses the share of heaps that are of the steeper kind."""
    return 1.0 / (1.0 + np.exp(-6.0 * (np.atleast_2d(x)[:, 2] - 0.2)))


def two_kinds(x: np.ndarray) -> np.ndarray:
    """The mean of heaps of two kinds; a single one is of either."""
    a, b, c = np.atleast_2d(x).T
    return 43.5 - 0.8 * a + 0.9 * b + 2.5 * c + STEP * packed(x)


SMOOTH = {"nearly plane": nearly_plane, "quadratic": quadratic, "saturating": saturating}
ROUGH = {"step": stepped, "two kinds": two_kinds}
TRUTHS = SMOOTH | ROUGH


@dataclass
class Bench:
    """One made-up study: a response, the true parameters (3,), the measured mean with its standard
    error, and a generator; `run` gives responses (n,) of runs at x (n, 3)."""

    response: object
    truth: np.ndarray
    measured: float
    se: float
    rng: np.random.Generator

    @classmethod
    def drawn(cls, response: Callable[[np.ndarray], np.ndarray], seed: int) -> Bench:
        """A study drawn by its seed."""
        rng = np.random.default_rng(seed)
        truth = rng.uniform(-INSIDE, INSIDE, 3)
        readings = response(truth)[0] + rng.normal(0.0, READING_SD, READINGS)
        se = readings.std(ddof=1) / np.sqrt(READINGS)
        return cls(response, truth, float(readings.mean()), float(se), rng)

    def run(self, x: np.ndarray) -> np.ndarray:
        """Responses (n,) of runs at x (n, 3), with the seeds' scatter and each of its kind."""
        y = self.response(x) + self.rng.normal(0.0, SEED_SD, len(np.atleast_2d(x)))  # type: ignore[operator]
        if self.response is not two_kinds:
            return y
        share = packed(x)
        return y + STEP * ((self.rng.random(len(share)) < share) - share)

    def missed(self, x: np.ndarray) -> float:
        """How far the response at a chosen point (3,) is from that of the truth [deg]."""
        return float(self.response(x)[0] - self.response(self.truth)[0])  # type: ignore[operator]
