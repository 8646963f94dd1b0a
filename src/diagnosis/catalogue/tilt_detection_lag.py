"""Sliding that is seen late."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from dem.constants import GRAVITY
from diagnosis.catalogue import Mechanism, Strength

TILT_RATE = 5.0  # where a table has no rate


def observe(value: Any, condition: Mapping[str, float], strength: float) -> Any:
    """Angle [deg] read `strength` mm after the start of sliding, while the plate goes on
    turning."""
    rate = math.radians(condition.get("tilt_rate_deg_s", TILT_RATE))
    slip = 1e-3 * np.maximum(strength, 0.0)
    cosine = np.cos(np.radians(np.minimum(value, 89.0)))
    return value + np.degrees(rate * np.cbrt(6.0 * slip * cosine / (GRAVITY * rate)))


MECHANISM = Mechanism(
    name="tilt_detection_lag",
    description="the plate turns on before sliding is seen; the excess grows as the tilt rate "
    "to the power 2/3",
    source="uniform acceleration g cos(theta) w t of a grain on a plate turning at w: slip g "
    "cos(theta) w t^3 / 6",
    experiments=("tilt",),
    strength=Strength("slip when seen", "mm", 0.0, 4.0),
    observe=observe,
    law=("reading", ("rate",)),
)
