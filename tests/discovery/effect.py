"""How large an effect is on a plan of measurements, and the strength that makes it so large.

The size is what the base model cannot take up. The base model is fitted to noise-free data of the
plan that contain the effect. The size is the largest distance of a setting from this fit, in
standard errors of that setting. A moderate effect is one of `MODERATE`: a tenth of a rebound that
is known to 1 %, two degrees of a sliding angle that is known to 0.2°.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.rates.hidden import standard_error
from diagnosis.emulator import forward, inverse
from diagnosis.fit import Data, fit
from diagnosis.settings import BASE

if TYPE_CHECKING:
    from diagnosis.model import Emulated


MODERATE = 10.0  # standard errors
STEPS = 161


def sizes(
    emulated: Emulated, conditions: Sequence[tuple[str, dict]], name: str, coded: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Size (k,) of an effect at k coded strengths, with the base parameters at their ranges'
    centre. Beside it the chi-square (k,) of the fitted base model, and whether its parameters lie
    within their ranges (k,)."""
    model = emulated.model(conditions, [name])
    theta = np.tile(model.prior_mean, (len(coded), 1))
    theta[:, -1] = coded
    value, _ = model.predict(theta)
    error = np.column_stack(
        [_error(emulated, *c, v) for c, v in zip(conditions, value.T, strict=True)]
    )
    base = fit(emulated.model(conditions), Data(value, error))
    distance = np.abs(value - base.predicted) / error
    return distance.max(1), (distance**2).sum(1), (np.abs(base.theta) <= 1.0).all(1)


def _error(emulated, experiment, levers, value):
    """Standard errors (k,) of values (k,) measured under one condition, with their scatter from run
    to run."""
    trained = emulated.emulators[experiment, BASE]
    by_z = inverse(experiment, forward(experiment, value, levers), levers)[1]
    return standard_error(experiment, value, np.abs(by_z) * trained.scatter)


def strength_at(
    emulated: Emulated, conditions: Sequence[tuple[str, dict]], name: str, wanted: float
) -> tuple[float, float]:
    """(strength in its unit, size): the weakest of the wanted size, or where none is so large the
    one that fits worst.

    One that leaves the base parameters within their ranges comes before one that does not: there
    the range, too, tells that something is wrong.
    """
    strength = emulated.catalogue[name].strength
    coded = strength.rising(STEPS)
    size, misfit, inside = sizes(emulated, conditions, name, coded)
    large = size >= wanted
    reached = [*np.flatnonzero(large & inside), *np.flatnonzero(large), np.argmax(misfit)]
    k = int(reached[0])
    return float(strength.natural(coded[k])), float(size[k])
