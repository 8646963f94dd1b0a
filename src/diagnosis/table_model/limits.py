"""Limits of laws that are not there: how much a coefficient may change over a plan, and how strong
a mechanism may be.

The limits of a slope are the wider of two. One is what the readings' own errors leave; errors from
setting to setting, of batches, of instruments and of the levels of other levers are averaged over.
The other pays for errors that the readings at one level of the law's levers share: a straight line
through the means of the levels, with the scatter of these means about it (Student's t; with several
levers Satterthwaite 1946, Biometrics Bulletin 2:110). Of two levels nothing is left over to tell
that scatter, so nothing is excluded.
"""

from dataclasses import replace

import numpy as np
from scipy import stats

from diagnosis.laws.forms import LADDER
from diagnosis.laws.readings import IN_AIR
from diagnosis.laws.slots import FreeLaw, coordinates, scaled
from diagnosis.table_model.block import Block
from diagnosis.table_model.curve import paid
from diagnosis.table_model.log_sum import log_sum
from diagnosis.table_model.term import Shape, Term, curve_shape

LIMIT = 0.95
EACH = 0.93
"""Probability on either side of each of the two limits of a slope. The wider of two holds more
often than either: in 480 simulated tables of three to five levels they held 93 % between both sides
where no errors are shared, 87 % where each level of the lever has an error of one to five errors of
a setting, and 96 % where those of another lever have."""

SLOPES = 161
LEAST_LEVELS = 3


def slope_limits(
    block: Block, law: FreeLaw, probability: float = EACH
) -> tuple[float | None, float | None]:
    """(low, high): ends below and above which the change of a coefficient over the plan's states is
    excluded, as shares, of a straight line over the logarithm of the state; None for an end that
    the slopes that are tried do not hold, and where a lever has two levels."""
    x = scaled(law, coordinates(block.readings))[0]
    key = next((k for k, h in block.held.items() if h.term.law is law), None)
    rest = block.without(key) if key else block
    by_levels = _by_levels(rest, law, x, probability)
    if by_levels is None:
        return None, None
    power = IN_AIR if law.experiment == "drop" else 1.0
    ends = np.linspace(-LADDER[-1], LADDER[-1], SLOPES)
    ends = np.sort(np.unique(np.concatenate([ends, _near(rest, power * x, ends[-1])])))
    shape = curve_shape("line", ends, power * ends[:, None] * x)
    shape = replace(shape, root=0.0 * shape.root)
    others = [n for n in block.readings.folds if n not in law.needs]
    low, high = _quantiles(paid(rest, others), shape, ends, probability)
    low = None if low is None else min(low, by_levels[0] / power)
    high = None if high is None else max(high, by_levels[1] / power)
    return tuple(None if e is None or abs(e) > ends[-1] else float(np.expm1(2.0 * e))
                 for e in (low, high))  # fmt: skip


def _by_levels(rest, law, x, probability):
    """(low, high) of the slope of the logarithm of the readings over x (n,), by the scatter of the
    means of the levels of the law's levers; None where one has two levels
    alone. A further column has no levels and adds nothing."""
    readings = rest.readings
    levers = [n for n in law.needs if n in readings.folds]
    if any(len(readings.folds[n]) < LEAST_LEVELS for n in levers):
        return None
    weight = 1.0 / readings.error**2
    y = readings.log - sum(rest.part(k) for k, h in rest.held.items() if h.term.what != "levels")
    along = x - np.average(x, weights=weight)
    pull = weight * along / (weight * along**2).sum()
    slope = float(pull @ y)
    parts = [_of_levels(readings.folds[n], weight, pull, x, y) for n in levers]
    variance = sum(v for v, _ in parts)
    if not variance:
        return slope, slope
    freedom = variance**2 / sum(v**2 / f for v, f in parts)
    reach = float(stats.t.ppf(probability, freedom)) * np.sqrt(variance)
    return slope - reach, slope + reach


def _of_levels(levels, weight, pull, x, y):
    """(variance of a slope, degrees of freedom) by the scatter of the means of levels [indices]
    about a straight line; pull: (n,) what the slope takes of each reading."""
    total = np.array([weight[i].sum() for i in levels])
    mean_x, mean_y = (np.array([np.average(v[i], weights=weight[i]) for i in levels])
                      for v in (x, y))  # fmt: skip
    design = np.column_stack([np.ones(len(levels)), mean_x]) * np.sqrt(total)[:, None]
    seen = mean_y * np.sqrt(total)
    left = seen - design @ np.linalg.lstsq(design, seen, rcond=None)[0]
    freedom = len(levels) - 2
    taken = np.array([pull[i].sum() for i in levels])
    return float((taken**2 / total).sum() * (left @ left) / freedom), freedom


def _near(rest, x, most):
    """Slopes (k,) about the likeliest, closer than the grid."""
    weight = 1.0 / rest.readings.error**2
    own = x - (weight * x).sum() / weight.sum()
    size = (weight * own**2).sum()
    best = (weight * own * (rest.readings.log - rest.mean)).sum() / size
    step = np.concatenate([np.linspace(-6.0, 6.0, 61), np.linspace(-40.0, 40.0, 81)]) / np.sqrt(
        size
    )
    return np.clip(best + step, -most, most)


def strength_limits(
    block: Block, term: Term, shape: Shape, probability: float = LIMIT
) -> tuple[float | None, float | None]:
    """(low, high) of a mechanism's coded strength, with an error of its own for each level."""
    rest = block.without(term.key) if term.key in block.held else block
    rest = paid(rest, term.law.needs if term.law else ())
    return _quantiles(rest, shape, np.asarray(shape.label), probability)


def _quantiles(rest, shape, at, probability):
    y = rest.readings.log[None]
    value = log_sum(rest.gains(shape, y, rest.base(y))[:, :, 0], axis=0)
    density = np.exp(value - value.max())
    mass = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(at))])
    mass /= mass[-1]
    low, high = np.interp([1.0 - probability, probability], mass, at)
    edge = 1e-3 * (at[-1] - at[0])
    open_low = density[0] > 0.05 or low < at[0] + edge
    open_high = density[-1] > 0.05 or high > at[-1] - edge
    return None if open_low else float(low), None if open_high else float(high)
