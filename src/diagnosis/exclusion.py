"""What emulated experiments exclude: how strong each mechanism can be at most. Single contacts have
`diagnosis.table_model.curve`.

The strength is held at one value after the other and everything else is fitted to the data. A value
is excluded if twice the logarithm of its likelihood lies below that of the best value by more than
chance gives in 95 % of cases (likelihood ratio of one parameter, one-sided: Wilks 1938, Ann. Math.
Stat. 9:60). The prior of the strength takes no part.
"""

import copy
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import chi2

from diagnosis.fit import fit, misfit
from diagnosis.identify import Identification
from diagnosis.settings import BASE

PROBABILITY = 0.95
FALL = float(chi2.ppf(2.0 * PROBABILITY - 1.0, 1))
"""Of twice the log likelihood, at which a value on one side of the best is excluded."""

STRENGTHS = 17


def of_mechanisms(found: Identification) -> list[dict[str, Any]]:
    """[{mechanism, ...}] of every single mechanism of an `Identification`, by the emulators."""
    data, out = found.data, []
    if found.verdict == "adequate":
        data = replace(data, scale=found.fits[BASE].scale[0])
    for name, model in found.models.items():
        if name == BASE or len(model.mechanisms) != 1:
            continue
        coded = np.linspace(0.0, 1.0, STRENGTHS)
        cost = np.array([_held(model, data, c) for c in coded])
        out.append(_of_mechanism(model.mechanisms[0], coded, cost))
    return out


def _held(model, data, coded):
    """Twice the negative log posterior of the best fit with the strength held at `coded`."""
    held = copy.copy(model)
    held.low, held.high = model.low.copy(), model.high.copy()
    held.prior_mean = model.prior_mean.copy()
    for bound in (held.low, held.high, held.prior_mean):
        bound[-1] = coded
    return float(misfit(held, data, fit(held, data, (coded,)).theta)[0])


def _of_mechanism(mechanism, coded, cost):
    """A row of a mechanism from the costs (k,) at its coded strengths (k,)."""
    strength = mechanism.strength
    off = strength.coded(strength.low if strength.off is None else strength.off)
    low, high = _allowed(coded, cost)
    # on the side of no effect nothing can be excluded that the data do not show
    below = low if low is not None and off > coded[0] else None
    above = high if high is not None and off < coded[-1] else None
    row = {"mechanism": mechanism.name, "of": strength.name, "unit": strength.unit}
    return row | {
        side: None if end is None else float(strength.natural(end))
        for side, end in (("below", below), ("above", above))
    }


def _allowed(at, cost):
    """(low, high): ends of what is not excluded among ascending values (k,). None if this is the
    end of the values."""
    rise = cost - cost.min()
    inside = np.flatnonzero(rise <= FALL)
    first, last = inside[0], inside[-1]
    low = None if first == 0 else _crossing(at[first - 1 : first + 1], rise[first - 1 : first + 1])
    high = None if last == len(at) - 1 else _crossing(at[last : last + 2], rise[last : last + 2])
    return low, high


def _crossing(at, rise):
    """Where between two values the rise meets FALL."""
    share = (FALL - rise[0]) / (rise[1] - rise[0])
    return float(at[0] + share * (at[1] - at[0]))
