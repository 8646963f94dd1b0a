"""What an emulator learns of an experiment's quantity."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calibration.intake.quantities import QUANTITIES
from dem.experiments.declare import Plain


class Logarithm(Plain):
    """A quantity that is positive and whose spread goes with its value."""

    def __init__(self, least: float) -> None:
        self.least = least

    def forward(self, value: np.ndarray, levers: Mapping[str, Any]) -> np.ndarray:
        """Logarithm of the value; that of `least` [the quantity's unit] for what is below."""
        return np.log(np.maximum(value, self.least))

    def inverse(self, z: np.ndarray, levers: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Value and its derivative."""
        value = np.exp(z)
        return value, value


def scale_of(experiment: str) -> Plain:
    """Return what an emulator learns of an experiment's quantity: its own scale where it declares
    one.

    Without one, the logarithm of what is known to a share of itself: an error of the emulator that
    is alike everywhere would else drown the small values."""
    quantity = QUANTITIES[experiment]
    if quantity.relative and type(quantity.scale) is Plain:
        return Logarithm(quantity.least)
    return quantity.scale
