"""What is asked of an optimum: the rules that choose one point of many, and the goals of
responses."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from calibration.errors import CalibrationError

RULES = ("closest_to_centre", "closest_to_point", "smallest_prediction_variance")


class Predicts(Protocol):
    """A model of a response over coded levels."""

    def predict(self, levels: npt.ArrayLike) -> np.ndarray:
        """Predicted response (n,) at coded levels (n, factors)."""


@dataclass(frozen=True)
class Goal:
    """What is wanted of one response: the target, and less the nearer it is to low or high."""

    low: float
    high: float
    target: float

    def __post_init__(self):
        if not self.low < self.high:
            raise CalibrationError(
                f"a goal's low ({self.low:g}) must be below high ({self.high:g})"
            )
        if not self.low < self.target < self.high:
            raise CalibrationError(
                f"a goal's target must lie between {self.low:g} and {self.high:g}, not at "
                f"{self.target}"
            )

    def desirability(self, y: npt.ArrayLike) -> np.ndarray:
        """0 to 1 of responses y (Derringer and Suich 1980, Journal of Quality Technology
        12:214)."""
        y = np.asarray(y, float)
        rising = (y - self.low) / (self.target - self.low)
        falling = (self.high - y) / (self.high - self.target)
        return np.clip(np.where(y <= self.target, rising, falling), 0.0, 1.0)


def combined_desirability(goals: Sequence[Goal], responses: Sequence[npt.ArrayLike]) -> np.ndarray:
    """Geometric mean (n,) of the desirabilities of responses (goals, n)."""
    each = np.array([g.desirability(y) for g, y in zip(goals, responses, strict=True)])
    with np.errstate(divide="ignore"):
        return np.exp(np.log(each).mean(0))


def overall_desirability(
    surfaces: Sequence[Predicts], goals: Sequence[Goal], points: npt.ArrayLike
) -> np.ndarray:
    """`combined_desirability` (n,) of what the surfaces predict at points (n, factors)."""
    return combined_desirability(goals, [s.predict(points) for s in surfaces])
