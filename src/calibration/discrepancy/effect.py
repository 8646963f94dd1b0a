"""How large an effect is on a plan of measurements, and the strength that makes it so large.

The size is what the base model cannot take up: on noise-free data of the plan with the effect in them, the largest
distance of a setting from the fitted base model, in standard errors of that setting. A moderate effect is one of
`MODERATE`: a tenth of a rebound that is known to 1 %, two degrees of a sliding angle that is known to 0.2°.
"""

import numpy as np

from calibration.discrepancy.fit import Data, fit
from calibration.discrepancy.hidden import standard_error

MODERATE = 10.0  # standard errors
STEPS = 161


def sizes(emulated, conditions, name, coded):
    """Size (k,) of an effect at k coded strengths, the base parameters at their ranges' centre.

    0 where the base model fits only with parameters outside their ranges: there it is the range that fails, whatever
    the effect.
    """
    model = emulated.model(conditions, [name])
    theta = np.tile(model.prior_mean, (len(coded), 1))
    theta[:, -1] = coded
    value, _ = model.predict(theta)
    error = np.column_stack(
        [standard_error(e, v) for (e, _), v in zip(conditions, value.T, strict=True)]
    )
    base = fit(emulated.model(conditions), Data(value, error))
    largest = (np.abs(value - base.predicted) / error).max(1)
    return np.where((np.abs(base.theta) <= 1.0).all(1), largest, 0.0)


def strength_at(emulated, conditions, name, wanted):
    """(strength in its unit, size): the weakest of the wanted size, or the end of the range where none is so large."""
    strength = emulated.catalogue[name].strength
    coded = strength.rising(STEPS)
    size = sizes(emulated, conditions, name, coded)
    reached = np.flatnonzero(size >= wanted)
    k = int(reached[0]) if len(reached) else STEPS - 1
    return float(strength.natural(coded[k])), float(size[k])
