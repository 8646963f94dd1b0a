"""The curve of a law with a band that holds it.

It is paid for by the errors that the readings may share: beside the law each level of its lever may
have an error of its own, as large as the data leave possible.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from calibration.statistics.numbers import NORMAL_95
from diagnosis.laws.forms import factors_of
from diagnosis.laws.readings import IN_AIR, SHAPE, Readings
from diagnosis.laws.slots import FreeLaw, coordinates, natural, scaled
from diagnosis.table_model.block import LEVEL_SD, Block
from diagnosis.table_model.log_sum import log_sum
from diagnosis.table_model.terms.laws import BENDS, FREE, SIZES, bend

POINTS, DRAWS = 25, 2000
BAND = 0.95
LEAST_SHARE = 2e-3  # probability of a place of the grid below which it takes no part


def paid(block: Block, levers: Iterable[str]) -> Block:
    """The block with an error of its own for each level of these levers."""
    readings = block.readings
    codes = {}
    for name in levers:
        levels = readings.folds.get(name, ())
        if 1 < len(levels) < len(readings.log):
            code = np.empty(len(readings.log), int)
            for k, index in enumerate(levels):
                code[index] = k
            codes[name] = code
    return replace(block, readings=replace(readings, groups=readings.groups | codes))


def unit_of(law: FreeLaw) -> str:
    """Unit of a law's values; the state's own is that of its power product."""
    if law.slot in ("restitution", "friction"):
        return "share" if law.weight else "1"
    if law.slot == "reading" and law.experiment == "tilt":
        return "deg"
    return {"drop": "mm", "tilt": "1", "shear": "kPa"}[law.experiment]


def curve(block: Block, key: str) -> tuple[list[dict[str, float]], dict[str, list[float]]]:
    """[{state, value, low, high}] along the state of a held law, and the range {state: [low, high]}
    that the settings cover. The band holds the whole curve in 95 % of cases. Of a column that acts
    with the size: the share by which it changes the coefficient where it is largest, along the
    size."""
    law = block.terms[key].law
    rest = paid(block.without(key), law.needs if law else ())
    if law.weight is None or unit_of(law) == "share":
        return _multiplied(rest, law)
    return _added(rest, block.terms[key], law)


def _rows(state, told, mean, low, high):
    out = []
    for k, s in enumerate(state):
        ends = sorted((float(told(k, low[k])), float(told(k, high[k]))))
        out.append(
            {"state": float(s), "value": float(told(k, mean[k])), "low": ends[0], "high": ends[1]}
        )
    return out


def _multiplied(rest, law):
    """Of the free curve of a law of a coefficient, over its sizes and those of the errors."""
    readings, y = rest.readings, rest.readings.log
    x, middle, half = scaled(law, coordinates(readings))
    at = np.linspace(-1.0, 1.0, POINTS)
    z = y - rest.mean
    share = law.weight(coordinates(readings), readings.centre) if law.weight else np.ones(len(x))
    level = 0.0 if law.weight else LEVEL_SD**2

    def spread(s, b, one, other):
        line = np.ones((len(one), len(other))) if law.weight else np.outer(one, other)
        return s**2 * (line + b**2 * bend(one, other))

    values, means, covers = [], [], []
    for b in BENDS:
        for s in SIZES:
            own = spread(s, b, x, x) * np.outer(share, share)
            cross = spread(s, b, at, x) * share + level
            here = spread(s, b, at, at) + level
            inverse = np.linalg.inv(rest.errors + rest.smooth + own)
            logdet = np.linalg.slogdet(rest.errors + rest.smooth + own)[1]
            pull = inverse @ z
            values.append(-0.5 * ((z * pull).sum(-1) + logdet) + rest.prior)
            means.append(pull @ cross.T)
            covers.append(here - cross @ inverse @ cross.T)
    values = np.concatenate(values)
    odds = np.exp(values - log_sum(values))
    means, covers = np.concatenate(means), np.concatenate(covers)
    kept = np.flatnonzero(odds > LEAST_SHARE)
    rng = np.random.default_rng(5)
    counts = rng.multinomial(DRAWS, odds[kept] / odds[kept].sum())
    drawn = np.concatenate(
        [_normal(means[i], covers[i], c, rng) for i, c in zip(kept, counts, strict=True)]
    )
    mean = odds[kept] @ means[kept] / odds[kept].sum()
    power = 1.0 / IN_AIR if law.experiment == "drop" else 1.0
    if law.weight:
        low, high = _band(drawn, mean)
        state = np.exp(middle + half * at)
        rows = _rows(state, lambda k, v: np.expm1(power * v), mean, low, high)
        return rows, {law.state[-1]: [float(state[0]), float(state[-1])]}
    drawn, mean = drawn + readings.centre[0], mean + readings.centre[0]
    low, high = _band(drawn, mean)
    most = 1.0 if law.slot == "restitution" else np.inf
    state = natural(law, coordinates(readings), middle + half * at)
    rows = _rows(state, lambda k, v: min(np.exp(power * v), most), mean, low, high)
    return rows, {" x ".join(law.state): [float(state[0]), float(state[-1])]}


def _normal(mean, cover, count, rng):
    size, direction = np.linalg.eigh(cover)
    root = direction * np.sqrt(np.maximum(size, 0.0))
    return mean + rng.standard_normal((count, len(mean))) @ root.T


def _band(drawn, mean):
    """Ends (m,) of a band as wide everywhere in standard deviations that holds whole draws."""
    spread = np.maximum(drawn.std(0), 1e-12)
    reach = np.quantile(np.abs((drawn - mean) / spread).max(1), BAND)
    reach = max(float(reach), NORMAL_95) * spread
    return mean - reach, mean + reach


def _added(rest, term, law):
    """Of a law that adds: over its named forms and their strengths."""
    y = rest.readings.log[None]
    levers = coordinates(rest.readings)
    base = rest.base(y)
    places, values = [], []
    for shape in term.shapes:
        if shape.catalogue or shape.name == FREE:
            continue
        own = log_sum(rest.gains(shape, y, base)[:, :, 0], axis=0)
        places += [(shape, k) for k in range(len(own))]
        values += list(own)
    share = np.exp(np.array(values) - log_sum(values))
    if law.coordinate:
        _, middle, half = scaled(law, levers)
        at = np.linspace(-1.0, 1.0, POINTS)
        state = natural(law, levers, middle + half * at)
    else:
        at, half, state = np.zeros(1), 0.0, np.ones(1)
    rng, factors = np.random.default_rng(5), factors_of(law)
    curves = []
    for i in rng.choice(len(share), DRAWS, p=share):
        shape, k = places[i]
        step = np.gradient(shape.label)[k] if len(shape.label) > 1 else 0.0
        strength = shape.label[k] + step * rng.uniform(-0.5, 0.5)
        curves.append(strength * factors[shape.name](half * at))
    curves = np.array(curves)
    told = told_in(law, rest.readings, state)
    rows = _rows(
        state, told, np.median(curves, 0), *np.quantile(curves, [0.5 - BAND / 2, 0.5 + BAND / 2], 0)
    )
    name = " x ".join(law.state)
    return rows, {name: [float(state[0]), float(state[-1])]} if law.coordinate else {}


def told_in(law: FreeLaw, readings: Readings, state: np.ndarray) -> Callable[[int, Any], Any]:
    """A function of place and value that turns a term in the law's space into the reading's unit,
    at the states (m,). What air takes depends on more than its state: it is told of the middle."""
    levers, centre = coordinates(readings), readings.centre
    one = law.weight(levers, centre) * levers.get(SHAPE.get(readings.experiment), 1.0)
    middle = np.exp(centre[0])
    one = one * (np.degrees(np.arctan(middle)) if law.space == "angle" else middle)
    if law.coordinate is None or law.slot == "drag":
        return lambda k, z: float(np.median(one)) * z
    here = law.coordinate(levers)
    least, most = np.argmin(np.where(one > 0.0, here, np.inf)), np.argmax(here)
    # a law of the simplest kind adds a power of its state
    power = np.log(one[most] / one[least]) / np.log(here[most] / here[least])
    return lambda k, z: float(one[most] * (state[k] / here[most]) ** power) * z
