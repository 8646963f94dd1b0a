"""The words and numbers of a law: its curve with a band, the forms and mechanisms that fit, and the
limits of laws that are not there.

The band is paid for by the errors that the readings may share: beside the law each level of its
lever may have an error of its own, as large as the data leave possible.

Each form, and each mechanism of the catalogue, is put in the law's place beside the other terms. It
is ruled out where its evidence is less than that of the best by the odds of 20 to 1
(`selection.ODDS`).

The limits of a slope are the wider of two. One is what the readings' own errors leave; errors from
setting to setting, of batches, of instruments and of the levels of other levers are averaged over.
The other pays for errors that the readings at one level of the law's levers share: a straight line
through the means of the levels, with the scatter of these means about it (Student's t; with several
levers Satterthwaite 1946, Biometrics Bulletin 2:110). Of two levels nothing is left over to tell
that scatter, so nothing is excluded.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from scipy import stats

from calibration.statistics.numbers import NORMAL_95
from diagnosis.catalogue import Mechanism
from diagnosis.chance import log_sum
from diagnosis.laws.readings import EXPONENT, SHAPE, Readings, level_of
from diagnosis.laws.slots import GIVEN, LADDER, FreeLaw, factors_of, natural, scaled
from diagnosis.table_model.block import LEAST_LEVELS, LEVEL_SD, Block, Shape, Term, curve_shape
from diagnosis.table_model.selection import ODDS
from diagnosis.table_model.terms import BENDS, FREE, FREE_SIZES, bend

POINTS, DRAWS = 25, 2000
BAND = 0.95
LEAST_SHARE = 2e-3  # probability of a place of the grid below which it takes no part


def paid(block: Block, levers: Iterable[str]) -> Block:
    """The block with an error of its own for each level of these levers."""
    own, n = block.readings, len(block.y)
    codes = {k: level_of(own.levers[k]) for k in levers if len(own.folds.get(k, own.log)) < n}
    return replace(block, readings=replace(own, groups=own.groups | codes))


def unit_of(law: FreeLaw) -> str:
    """Unit of a law's values; the state's own is that of its power product."""
    if law.slot in ("restitution", "friction"):
        return "share" if law.weight else "1"
    if law.slot == "reading" and law.experiment == "tilt":
        return "deg"
    return {"drop": "mm", "tilt": "1", "shear": "kPa"}[law.experiment]


def curve(block: Block, key: str) -> list[dict[str, float]]:
    """[{state, value, low, high}] along the state of a held free law, over what the settings cover.
    The band holds the whole curve in 95 % of cases. Of a column that acts with the size: the share
    by which it changes the coefficient where it is largest, along the size."""
    term = block.terms[key]
    law, rest = term.law, paid(block.without(key), term.law.needs)
    _, middle, half = scaled(law, rest.readings)
    at = np.linspace(-1.0, 1.0, POINTS) if law.coordinate else np.zeros(1)
    state = natural(law, rest.readings, middle + half * at)
    if law.weight is None or unit_of(law) == "share":
        curves = _multiplied(rest, law, at)
    else:
        one = told_in(law, rest.readings, state)
        curves = tuple(one * v for v in _added(rest, term, half * at))
    value, *ends = curves
    columns = zip(state, value, np.minimum(*ends), np.maximum(*ends), strict=True)
    names = ("state", "value", "low", "high")
    return [dict(zip(names, map(float, row), strict=True)) for row in columns]


def _multiplied(rest, law, at):
    """(mean, low, high) of the free curve of a law of a coefficient at scaled states (m,), over its
    sizes and those of the errors."""
    readings, z = rest.readings, rest.y - rest.mean
    x = scaled(law, readings)[0]
    share = law.weight(readings) if law.weight else np.ones(len(x))
    level = 0.0 if law.weight else LEVEL_SD**2

    def spread(s, b, one, other):
        line = np.ones((len(one), len(other))) if law.weight else np.outer(one, other)
        return s**2 * (line + b**2 * bend(one, other))

    values, means, covers = [], [], []
    for b, s in product(BENDS, FREE_SIZES):
        total = rest.errors + rest.smooth + spread(s, b, x, x) * np.outer(share, share)
        cross = spread(s, b, at, x) * share + level
        inverse = np.linalg.inv(total)
        pull = inverse @ z
        values.append(-0.5 * ((z * pull).sum(-1) + np.linalg.slogdet(total)[1]) + rest.prior)
        means.append(pull @ cross.T)
        covers.append(spread(s, b, at, at) + level - cross @ inverse @ cross.T)
    values, means, covers = map(np.concatenate, (values, means, covers))
    odds = np.exp(values - log_sum(values))
    kept = np.flatnonzero(odds > LEAST_SHARE)
    share = odds[kept] / odds[kept].sum()
    rng, drawn = np.random.default_rng(5), []
    for i, count in zip(kept, rng.multinomial(DRAWS, share), strict=True):
        size, direction = np.linalg.eigh(covers[i])
        root = direction * np.sqrt(np.maximum(size, 0.0))
        drawn.append(means[i] + rng.standard_normal((count, len(at))) @ root.T)
    centre = 0.0 if law.weight else readings.centre[0]
    mean, drawn = share @ means[kept] + centre, np.concatenate(drawn) + centre
    # a band as wide everywhere in standard deviations, that holds whole draws
    sd = np.maximum(drawn.std(0), 1e-12)
    reach = np.quantile(np.abs((drawn - mean) / sd).max(1), BAND)
    reach = max(float(reach), NORMAL_95) * sd
    logs = np.array([mean, mean - reach, mean + reach]) / EXPONENT[law.experiment]
    if law.weight:
        return np.expm1(logs)
    return np.minimum(np.exp(logs), 1.0 if law.slot == "restitution" else np.inf)


def _added(rest, term, t):
    """(median, low, high) of a law that adds, in its space, at logarithms of the state over the
    middle one (m,): over its named forms and their strengths."""
    named = [s for s in term.shapes if not s.catalogue and s.name != FREE]
    values = np.concatenate([rest.by_strength(s) for s in named])
    rng, factors = np.random.default_rng(5), factors_of(term.law)
    drawn = rng.choice(len(values), DRAWS, p=np.exp(values - log_sum(values)))
    label = np.concatenate([s.label for s in named])
    steps = [np.gradient(s.label) if len(s.label) > 1 else np.zeros(1) for s in named]
    strength = label[drawn] + np.concatenate(steps)[drawn] * rng.uniform(-0.5, 0.5, DRAWS)
    one = np.array([factors[s.name](t) for s in named for _ in s.label])
    curves = strength[:, None] * one[drawn]
    ends = np.quantile(curves, [0.5 - BAND / 2, 0.5 + BAND / 2], 0)
    return np.median(curves, 0), *ends


def told_in(law: FreeLaw, readings: Readings, state: np.ndarray) -> np.ndarray:
    """(m,) what one in the law's space adds in the reading's unit, at states (m,). What air takes
    depends on more than its state: it is told of the middle."""
    levers = readings.columns
    assert law.weight is not None  # a term is added
    one = law.weight(readings) * levers.get(SHAPE.get(readings.experiment, ""), 1.0)
    middle = np.exp(readings.centre[0])
    one = one * (np.degrees(np.arctan(middle)) if law.space == "angle" else middle)
    if law.coordinate is None or law.slot == "drag":
        return np.full(len(state), np.median(one))
    here = law.coordinate(levers)
    least, most = np.argmin(np.where(one > 0.0, here, np.inf)), np.argmax(here)
    # a law of the simplest kind adds a power of its state
    power = np.log(one[most] / one[least]) / np.log(here[most] / here[least])
    told: np.ndarray = one[most] * (state / here[most]) ** power
    return told


SAME = 0.5
"""Standard errors of a reading; curves that stay closer are one."""


def named(block: Block, key: str) -> tuple[dict[str, Any], str]:
    """({names, forms, formulas, coded}, likeliest of all) of a law that is held in a block. names:
    mechanisms that fit as well as the best form; forms: forms that do and are another curve, the
    best first; formulas: {form: text}; coded: {mechanism: its coded strength}."""
    rest, term = block.without(key), block.terms[key]
    evidence: dict[str, float] = {}
    held = {}
    for shape in term.shapes:
        value = float(log_sum(rest.by_strength(shape)) - np.log(len(shape.label)))
        if value > evidence.get(shape.name, -np.inf):
            evidence[shape.name] = value
            held[shape.name] = rest.holding(key, replace(term, shapes=(shape,)))
    known = {s.name for s in term.shapes if s.catalogue}
    order = sorted(evidence, key=lambda n: -evidence[n])
    left = [n for n in order if evidence[order[0]] - evidence[n] < ODDS]
    curves = {n: held[n].part(key) for n in left}
    names = [n for n in left if n in known]

    def alike(one, other):
        apart = curves[one] - curves[other]
        return np.abs((apart - apart.mean()) / block.readings.error).max() < SAME

    forms = [n for n in left if n not in known and not any(alike(n, k) for k in names)]
    formulas = {n: written(held[n], key, n) for n in forms if n != FREE and term.law}
    # a free curve follows every form: it is told only where nothing else is left
    forms = [n for n in forms if n != FREE] if len(left) > 1 and left[0] != FREE else forms
    # of simulated tests a free law has a strength as well, of single contacts a mechanism alone
    strong = [n for n in names or order[:1] if n in known or term.law is None]
    coded = {n: held[n].strength(key) for n in strong}
    return {"names": names, "forms": forms, "formulas": formulas, "coded": coded}, order[0]


def written(block: Block, key: str, name: str) -> str:
    """A named form with its coefficients, as fitted to the readings."""
    law, k = block.terms[key].law, block.strength(key)
    state = " x ".join(law.state)
    units = " ".join(GIVEN["units"].get(s, "") for s in law.state)
    at = " ".join(f"{np.exp(scaled(law, block.readings)[1]):.3g} {units}".split())
    column = block.readings.columns.get(state, np.ones(1))
    if (column <= 0.0).any():  # its coordinate is an exponential
        state = f"exp(({state} - {column.mean():.3g}) / {0.5 * np.ptp(column):.3g})"
    if law.weight:
        share = f"{100 * k:+.3g} %"
        return f"{name} (at a {state} of {at}: {share})" if state else f"{name}: {share}"
    shape = block.held[key].shape
    number = int(np.argmin(np.abs(shape.label - k)))
    assert shape.mean is not None  # a named form is a curve
    level = block.y - sum(block.part(o) for o in block.held if o != key) - shape.mean[number]
    c = np.exp(block.readings.level(level) / EXPONENT[law.experiment])
    text = GIVEN["formulas"].get(name, GIVEN["formulas"]["step"])
    return f"{name}: {law.slot} = {text.format(c=f'{c:.3g}', k=k, s=state, m=at)}"


EACH = 0.93
"""Probability on either side of each of the two limits of a slope. The wider of two holds more
often than either: in 480 simulated tables of three to five levels they held 93 % between both sides
where no errors are shared, 87 % where each level of the lever has an error of one to five errors of
a setting, and 96 % where those of another lever have."""

SLOPES = 161


def slope_limits(block: Block, law: FreeLaw) -> tuple[float | None, float | None]:
    """(low, high): ends below and above which the change of a coefficient over the plan's states is
    excluded, as shares, of a straight line over the logarithm of the state; None for an end that
    the slopes that are tried do not hold, and where a lever has two levels."""
    x = scaled(law, block.readings)[0]
    rest = replace(block, held={k: h for k, h in block.held.items() if h.term.law is not law})
    by_levels = _by_levels(rest, law, x)
    if by_levels is None:
        return None, None
    power = EXPONENT[law.experiment]
    ends = np.linspace(-LADDER[-1], LADDER[-1], SLOPES)
    ends = np.sort(np.unique(np.concatenate([ends, _near(rest, power * x, ends[-1])])))
    shape = curve_shape("line", ends, power * ends[:, None] * x)
    shape = replace(shape, root=0.0 * shape.root)
    others = [n for n in block.readings.folds if n not in law.needs]
    low, high = _quantiles(paid(rest, others), shape, ends, EACH)
    low = None if low is None else min(low, by_levels[0] / power)
    high = None if high is None else max(high, by_levels[1] / power)
    below, above = (None if e is None or abs(e) > ends[-1] else float(np.expm1(2.0 * e))
                    for e in (low, high))  # fmt: skip
    return below, above


def _by_levels(rest, law, x):
    """(low, high) of the slope of the logarithm of the readings over x (n,), by the scatter of the
    means of the levels of the law's levers; None where one has two levels alone. A further column
    has no levels and adds nothing."""
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
    reach = float(stats.t.ppf(EACH, freedom)) * np.sqrt(variance)
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
    own = x - rest.readings.level(x)
    size = (weight * own**2).sum()
    best = (weight * own * (rest.y - rest.mean)).sum() / size
    steps = np.concatenate([np.linspace(-6.0, 6.0, 61), np.linspace(-40.0, 40.0, 81)])
    return np.clip(best + steps / np.sqrt(size), -most, most)


def strength_limits(
    block: Block, term: Term, shape: Shape, probability: float = BAND
) -> tuple[float | None, float | None]:
    """(low, high) of a mechanism's coded strength, with an error of its own for each level."""
    rest = paid(block.without(term.key), term.law.needs if term.law else ())
    return _quantiles(rest, shape, np.asarray(shape.label), probability)


def _quantiles(rest, shape, at, probability):
    value = rest.by_strength(shape)
    density = np.exp(value - value.max())
    mass = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(at))])
    mass /= mass[-1]
    low, high = np.interp([1.0 - probability, probability], mass, at)
    edge = 1e-3 * (at[-1] - at[0])
    open_low = density[0] > 0.05 or low < at[0] + edge
    open_high = density[-1] > 0.05 or high > at[-1] - edge
    return None if open_low else float(low), None if open_high else float(high)


def limits(blocks: Mapping[str, Block], catalogue: Mapping[str, Mechanism]) -> list[dict[str, Any]]:
    """[{mechanism or slot and state, of, unit, below, above}]: what the data exclude, at 95 % each
    way."""
    out, slopes = [], []
    for block, term in ((b, t) for b in blocks.values() for t in b.terms.values()):
        for shape in (s for s in term.shapes if s.name in catalogue):
            strength, ends = catalogue[shape.name].strength, strength_limits(block, term, shape)
            # on the side of no effect nothing can be excluded that the data do not show
            shows = strength.weakest > shape.label[0], strength.weakest < shape.label[-1]
            below, above = (float(strength.natural(end)) if there and end is not None else None
                            for end, there in zip(ends, shows, strict=True))  # fmt: skip
            row = {"mechanism": shape.name, "of": strength.name, "unit": strength.unit}
            out.append(row | {"below": below, "above": above})
        law = term.law
        if law is not None and term.free and law.weight is None:
            low, high = slope_limits(block, law)
            row = {"experiment": law.experiment, "slot": law.slot, "state": list(law.state)}
            row |= {"of": "change over the plan's states", "unit": "share"}
            slopes.append(row | {"below": low, "above": high})
    return out + slopes
