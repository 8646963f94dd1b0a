"""An apex that lies between two frames of a film."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dem.constants import GRAVITY
from diagnosis.catalogue import Mechanism, Strength


def observe(value: Any, condition: Mapping[str, float], strength: float) -> Any:
    """Rebound [mm] as read: less the mean deficit g dt^2 / 24 of an apex at a random phase between
    frames."""
    interval = strength * condition.get("output_interval_s", 0.0)
    return np.maximum(value - 1e3 * GRAVITY * interval * interval / 24.0, 1e-3)


MECHANISM = Mechanism(
    name="apex_sampling",
    description="the apex lies between two frames; the rebound reads low by g dt^2 / 24 on average",
    source="mean over a uniform phase of the parabola's deficit, at most g dt^2 / 8",
    experiments=("drop",),
    strength=Strength("frame interval over the stated one", "1", 0.0, 2.0),
    observe=observe,
    law=("reading", ("interval",)),
)
