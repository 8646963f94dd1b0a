"""The kinds of terms of one experiment: laws, errors of the set-up, and single rows."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from diagnosis.laws.readings import SHAPE, Readings, level_of
from diagnosis.laws.slots import BOTH, FAMILY, applicable, forms_of, scaled, steps_of
from diagnosis.table_model.block import (
    ERROR,
    LAW,
    ROW,
    SIZES,
    Block,
    Shape,
    Term,
    curve_shape,
    random_term,
)

FREE = "free curve"
SHARE_OF_FREE = 0.3  # prior probability of the free curve among the shapes of a place
FREE_SIZES = np.geomspace(0.005, 1.5, 8)
BENDS = (0.0, 0.5, 1.5)
"""Bend of a free curve over its straight part, half the range of the state being one."""

LENGTH = 0.8  # correlation length of the bend, over a range from -1 to 1

UNLIKELY_LEVEL = -2.0
"""Log prior odds of one level that was set wrongly where the reading does not go with the lever: a
wrong size shows only through a law."""

UNLIKELY_ORDER = -3.0
"""Log prior odds of a drift: a table that is sorted by a lever need not stand in the order of the
tests."""

BENDS_OF_ORDER = (0.0, 0.7)
LEAST_ROWS = 5  # readings of an experiment, for a drift or a single row
SIZES_OF_ROW = np.geomspace(0.02, 1.5, 7)

LIKELY = 3.0
"""Log prior odds of rounding where the digits show the step, against a law."""

LEAST_SHARE = 0.3
"""Share of the median error below which a step adds nothing."""


def all_terms(readings: Readings, known: Sequence[tuple[tuple, Shape]]) -> list[Term]:
    """[`Term`] of every kind for the `Readings` of one experiment; known: [(place, `Shape`)] of the
    catalogue's mechanisms."""
    out = exchanged(readings) + laws(readings, known)
    errors = level_offsets, one_level, order, resolution, rows, zero
    return out + [term for kind in errors for term in kind(readings)]


def laws(readings: Readings, known: Sequence[tuple[tuple, Shape]]) -> list[Term]:
    """A term for each place: of the free laws whose levers vary, and of the catalogue's entries.
    Its shapes are named forms, a free curve, and the catalogue's mechanisms."""
    kind = readings.experiment
    free_laws = {(law.slot, law.state): law for law in applicable(readings)}
    family = {(law.slot, law.state): law for law in FAMILY if law.experiment == kind} | free_laws
    out = []
    for place in dict.fromkeys([*free_laws, *(place for place, _ in known)]):
        law, own = family.get(place), free_laws.get(place)
        shapes = _shapes(forms_of(own, readings)) if own else []
        shapes += [shape for where, shape in known if where == place]
        steps = steps_of(own, readings) if own else {}
        free = own is not None and not own.sign and own.coordinate is not None
        # all places of a step together are one form
        each = (1.0 - SHARE_OF_FREE * free) / max(len(shapes) + bool(steps), 1)
        shapes = [replace(s, weight=float(np.log(each))) for s in shapes]
        shapes += _shapes(steps, float(np.log(each / max(len(steps), 1))))
        shapes += [_free_curve(law, readings)] if free else []
        key = f"{kind}:{place[0]}({', '.join(place[1])})"
        odds = law.odds if law else 0.0
        out.append(Term(kind, LAW, key, tuple(shapes), odds, law=law, place=place))
    return out


def _shapes(forms, weight=0.0):
    """`Shape`s of `slots.Forms`: both signs of a strength are curves of their own."""
    return [
        curve_shape(name, label[side], curves[side], weight=weight)
        for name, (label, curves) in forms.items()
        for side in (label < 0.0, label > 0.0)
        if side.any()
    ]


def _free_curve(law, readings):
    """`Shape` of a Gaussian process over the scaled logarithm of the state; root (k, n, 2 + bend).

    To first order in its size, where the law adds to the reading."""
    x = scaled(law, readings)[0]
    slope = law.weight(readings) if law.weight else np.ones(len(x))
    line = np.ones(len(x)) if law.weight else x
    return _bent(FREE, line, x, slope, (FREE_SIZES, BENDS), float(np.log(SHARE_OF_FREE)))


def _bent(name, line, x, slope, tried, weight):
    """`Shape` of a line (n,) with a bend over scaled states (n,), both times a slope (n,), at each
    of the sizes and bends that are tried."""
    sizes, bends = tried
    bend = bend_root(x)
    own = [np.hstack([line[:, None], b * bend]) * slope[:, None] for b in bends]
    roots = np.array([s * root for root in own for s in sizes])
    return Shape(name, np.tile(sizes, len(bends)), roots, weight=weight)


def bend_root(x: np.ndarray) -> np.ndarray:
    """Root (n, r) of the squared exponential of the distances of scaled states (n,)."""
    levels, place = np.unique(np.round(x, 9), return_inverse=True)
    values, vectors = np.linalg.eigh(bend(levels, levels))
    kept = values > 1e-6 * values.max()
    return (vectors[:, kept] * np.sqrt(values[kept]))[place]


def bend(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Squared exponential (n, m) of the distances of two scaled states."""
    return np.exp(-0.5 * ((x[:, None] - y[None, :]) / LENGTH) ** 2)


def smooth_terms(block: Block) -> Iterator[tuple[str, Term]]:
    """(lever, a smooth curve along it) of each lever of a block that all readings of an experiment
    have: a squared exponential about a straight line over the logarithm."""
    n = len(block.readings.log)
    for kind in block.readings.experiments:
        own, at = block.readings.of(kind)
        for lever in own.folds:
            value = own.levers[lever]
            if np.isnan(value).any():
                continue
            x = np.log(value) if (value > 0.0).all() else value
            x = 2.0 * (x - x.min()) / np.ptp(x) - 1.0
            root = np.zeros((n, 1 + bend_root(x).shape[1]))
            root[at] = np.column_stack([x, bend_root(x)])
            yield lever, Term(kind, LAW, lever, (random_term(root),))


def exchanged(readings: Readings) -> list[Term]:
    """A term of two levels that were taken for each other, of the lever that the reading goes with,
    where it has three levels or more; its shapes are the pairs. What the readings at one level lose
    those at the other gain."""
    lever = SHAPE.get(readings.experiment, "")
    levels = readings.folds.get(lever, ())
    if len(levels) < 3:
        return []
    value, n, shapes = readings.levers[lever], len(readings.log), []
    pairs = list(combinations(levels, 2))
    for one, other in pairs:
        low, high = value[one[0]], value[other[0]]
        curve = np.zeros(n)
        curve[one], curve[other] = np.log(high / low), np.log(low / high)
        name, weight = f"{low:g} and {high:g}", -float(np.log(len(pairs)))
        shapes.append(Shape(name, np.ones(1), np.zeros((1, n, 1)), curve[None], weight))
    return [_error(readings, "exchanged", lever, shapes, name=f"exchanged {lever}")]


def level_offsets(readings: Readings) -> list[Term]:
    """One term for each lever with two levels or more, each set up with an error of its own: a
    camera that is set anew for each height, a lot of grains for each size. A level of its own for
    each reading is excepted: that is the error from setting to setting."""
    roots = {lever: np.eye(len(levels))[level_of(readings.levers[lever])]
             for lever, levels in readings.folds.items()
             if len(levels) < len(readings.log)}  # fmt: skip
    return [_error(readings, "levels", lever, [random_term(r)]) for lever, r in roots.items()]


def one_level(readings: Readings) -> list[Term]:
    """A term for each lever with three levels or more, one of which was set wrongly: 120 mm that
    were 132 mm. Its shapes are its levels."""
    out = []
    for lever, levels in readings.folds.items():
        several = [index for index in levels if len(index) > 1]
        if len(levels) < 3 or not several:
            continue
        value, share = readings.levers[lever], -np.log(len(several))
        shapes = [random_term(_of_rows(readings, i), f"{value[i[0]]:g}", weight=share)
                  for i in several]  # fmt: skip
        odds = 0.0 if SHAPE.get(readings.experiment) == lever else UNLIKELY_LEVEL
        out.append(_error(readings, "one level", lever, shapes, odds))
    return out


def order(readings: Readings) -> list[Term]:
    """One term of a drift, such as wear or a day that grows damp: a line and a bend over the number
    of the row, or over its logarithm."""
    if len(readings.log) < LEAST_ROWS:
        return []
    number = np.argsort(np.argsort(readings.rows)).astype(float)
    shapes = []
    for name, at in (("even", number), ("at first", np.log1p(number))):
        x = 2.0 * (at - at.min()) / np.ptp(at) - 1.0
        tried = SIZES, BENDS_OF_ORDER
        shapes.append(_bent(name, x, x, np.ones(len(x)), tried, -np.log(2.0)))
    return [_error(readings, "", "order", shapes, UNLIKELY_ORDER)]


def resolution(readings: Readings) -> list[Term]:
    """One term where every reading is a multiple of a step. What rounding takes off is alike for
    readings that were rounded to one value, if they stand for one."""
    step = readings.step
    if step is None:
        return []
    share = rounded_off(readings)
    if np.median(share / readings.error) < LEAST_SHARE:
        return []
    single = np.diag(share)
    # rounding takes the same from readings of one value, and of one true value as a constant
    # coefficient has it
    lever = readings.levers.get(SHAPE.get(readings.experiment, ""), np.zeros(len(share)))
    shared = [share[:, None] * (v[:, None] == np.unique(v)) for v in (readings.values, lever)]
    roots = [single, *shared, *(np.sqrt(0.5) * np.hstack([single, r]) for r in shared)]
    weight = -np.log(len(roots))
    shapes = [Shape("rounded", np.array([step]), r[None], weight=weight) for r in roots]
    return [_error(readings, "", "resolution", shapes, LIKELY, more={"step": step})]


def rounded_off(readings: Readings) -> np.ndarray:
    """Standard deviation (n,) of what rounding to the readings' step takes off a logarithm."""
    return readings.step / np.sqrt(12.0) / np.abs(readings.values) * np.abs(readings.relative)


def rows(readings: Readings) -> list[Term]:
    """One term for each single row that contradicts all others, all together as probable as a
    law."""
    n, kind, out = len(readings.log), readings.experiment, []
    for i in range(n) if n >= LEAST_ROWS else ():
        own = (random_term(_of_rows(readings, i), "row", SIZES_OF_ROW),)
        out.append(Term(kind, ROW, f"{kind}:row {i}", own, -np.log(n), rows=(i,)))
    return out


def zero(readings: Readings) -> list[Term]:
    """One term of a wrong zero of the lever that the reading goes with, where it varies: all
    heights off by one length, all normal stresses by one load. Its strengths are what is added, in
    the lever's unit."""
    lever = SHAPE.get(readings.experiment, "")
    if lever not in readings.folds:
        return []
    value = readings.levers[lever]
    own = BOTH[BOTH > -0.95] * value.min()
    shapes = _shapes({"zero": (own, np.log1p(own[:, None] / value))}, -np.log(2.0))
    return [_error(readings, "zero", lever, shapes)]


def _error(readings, what, of, shapes, weight=0.0, name="", **more):
    """`Term` of an error of the set-up, with a name of its own in its experiment."""
    key = f"{readings.experiment}:{name or (f'{what} of {of}' if what else of)}"
    own = readings.experiment, ERROR, key, tuple(shapes), weight
    return Term(*own, of=of, what=what, **more)


def _of_rows(readings, index):
    """Root (n, 1) of what the readings at `index` alone have."""
    root = np.zeros((len(readings.log), 1))
    root[index] = 1.0
    return root
