"""What is asked of an optimum: the rules that choose one point of many, and the goals of
responses."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from calibration.errors import CalibrationError

RULES = ("closest_to_centre", "closest_to_point", "smallest_prediction_variance")
GOALS = ("target", "maximise", "minimise")


class Predicts(Protocol):
    """A model of a response over coded levels."""

    def predict(self, levels: npt.ArrayLike) -> np.ndarray:
        """Predicted response (n,) at coded levels (n, factors)."""


@dataclass(frozen=True)
class Goal:
    """What is wanted of one response: 'target', 'maximise' or 'minimise' between low and high;
    weight shapes the ramp."""

    kind: str
    low: float
    high: float
    target: float | None = None
    weight: float = 1.0
    importance: float = 1.0

    def __post_init__(self):
        if self.kind not in GOALS:
            raise CalibrationError(f"unknown goal {self.kind!r}; known: {', '.join(GOALS)}")
        if not self.low < self.high:
            raise CalibrationError(
                f"a goal's low ({self.low:g}) must be below high ({self.high:g})"
            )
        inside = self.target is not None and self.low < self.target < self.high
        if self.kind == "target" and not inside:
            raise CalibrationError(
                f"a goal's target must lie between {self.low:g} and {self.high:g}, not at "
                f"{self.target}"
            )
        if self.weight <= 0 or self.importance <= 0:
            raise CalibrationError("a goal's weight and importance must be above 0")

    def desirability(self, y: npt.ArrayLike) -> np.ndarray:
        """0 to 1 of responses y (Derringer and Suich 1980, Journal of Quality Technology
        12:214)."""
        y = np.asarray(y, float)
        d: np.ndarray
        if self.kind == "maximise":
            d = (y - self.low) / (self.high - self.low)
        elif self.kind == "minimise":
            d = (self.high - y) / (self.high - self.low)
        else:
            assert self.target is not None  # as __post_init__ saw to
            rising = (y - self.low) / (self.target - self.low)
            d = np.where(y <= self.target, rising, (self.high - y) / (self.high - self.target))
        return np.clip(d, 0.0, 1.0) ** self.weight


def combined_desirability(goals: Sequence[Goal], responses: Sequence[npt.ArrayLike]) -> np.ndarray:
    """Geometric mean (n,) of the desirabilities of responses (goals, n), weighted by importance."""
    weight = np.array([g.importance for g in goals])
    each = np.array([g.desirability(y) for g, y in zip(goals, responses, strict=True)])
    with np.errstate(divide="ignore"):
        return np.exp((weight[:, None] * np.log(each)).sum(0) / weight.sum())


def overall_desirability(
    surfaces: Sequence[Predicts], goals: Sequence[Goal], points: npt.ArrayLike
) -> np.ndarray:
    """`combined_desirability` (n,) of what the surfaces predict at points (n, factors)."""
    return combined_desirability(goals, [s.predict(points) for s in surfaces])
