"""The rebound is read from frames and its highest point falls between two of them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dem.constants import GRAVITY
from diagnosis.catalogue import Mechanism, Strength


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Heights at frames only; the frame interval is the stated one times the strength."""
    geometry = spec["geometry"]
    stated = geometry.get("output_interval_s")
    if not stated or strength <= 0.0:
        return spec
    return spec | {"geometry": geometry | {"output_interval_s": stated * strength}}


def observe(
    value: np.ndarray | float, condition: Mapping[str, float], strength: np.ndarray | float
) -> np.ndarray:
    """Rebound [mm] as read: less the mean deficit g dt^2 / 24 of an apex at a random phase between
    frames. value and strength: numbers or arrays of one shape."""
    interval = strength * condition.get("output_interval_s", 0.0)
    return np.maximum(value - 1e3 * GRAVITY * interval * interval / 24.0, 1e-3)


MECHANISM = Mechanism(
    name="apex_sampling",
    description="the apex lies between two frames; the rebound reads low by g dt^2 / 24 on average",
    source="mean over a uniform phase of the parabola's deficit, at most g dt^2 / 8",
    experiments=("drop",),
    levers=("output_interval_s",),
    strength=Strength("frame interval over the stated one", "1", 0.0, 2.0),
    apply=apply,
    observe=observe,
    law=("reading", ("interval",)),
)
