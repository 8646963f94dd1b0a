"""Laws: a slot and a state, with named forms, a free curve, and the catalogue's mechanisms."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from diagnosis.laws.forms import forms_of, steps_of
from diagnosis.laws.known import Known
from diagnosis.laws.readings import Readings
from diagnosis.laws.slots import FAMILY, FreeLaw, applicable, coordinates, scaled
from diagnosis.table_model.term import LAW, Shape, Term, curve_shape

FREE = "free curve"
SHARE_OF_FREE = 0.3  # prior probability of the free curve among the shapes of a place
SIZES = np.geomspace(0.005, 1.5, 8)
BENDS = (0.0, 0.5, 1.5)
"""Bend of a free curve over its straight part, half the range of the state being one."""

LENGTH = 0.8  # correlation length of the bend, over a range from -1 to 1


def terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """A term for each place: of the free laws whose levers vary, and of the catalogue's entries."""
    centre = readings.centre
    laws = {(law.slot, law.state): law for law in applicable(readings)}
    places = dict.fromkeys([*laws, *(k.place for k in known.values())])
    out = []
    for place in places:
        law, shapes, steps = laws.get(place), [], {}
        if law is not None:
            shapes = _shapes(forms_of(law, readings, centre))
            steps = steps_of(law, readings)
        own = [
            curve_shape(k.name, k.label, k.curves, catalogue=True, own_level=k.own_level)
            for k in known.values()
            if k.place == place
        ]
        # all places of a step together are one form
        named = len(shapes) + len(own) + bool(steps)
        free = law is not None and not law.sign and law.coordinate is not None
        share = 1.0 - SHARE_OF_FREE * free
        shapes = [_weighted(s, np.log(share / named)) for s in (*shapes, *own)]
        shapes += [_weighted(s, np.log(share / named / len(steps))) for s in _shapes(steps)]
        if free:
            shapes.append(free_curve(law, readings, centre, np.log(SHARE_OF_FREE)))  # type: ignore[arg-type]
        slot, state = place
        key = f"{readings.experiment}:{slot}({', '.join(state)})"
        law = law or next(
            (
                f
                for f in FAMILY
                if (f.experiment, f.slot, f.state) == (readings.experiment, slot, state)
            ),
            None,
        )
        odds = law.odds if law else 0.0
        out.append(Term(readings.experiment, LAW, key, tuple(shapes), odds, law=law, place=place))
    return out


def _weighted(shape, weight):

    return replace(shape, weight=float(weight))


def _shapes(forms):
    out = []
    for name, (label, curves) in forms.items():
        # both signs of a strength are curves of their own
        for side in (label < 0.0, label > 0.0):
            if side.any():
                out.append(curve_shape(name, label[side], curves[side]))
    return out


def free_curve(law: FreeLaw, readings: Readings, centre: np.ndarray, weight: float = 0.0) -> Shape:
    """`Shape` of a Gaussian process over the scaled logarithm of the state; root (k, n, 2 + bend).

    To first order in its size, where the law adds to the reading."""
    x = scaled(law, coordinates(readings))[0]
    slope = law.weight(coordinates(readings), centre) if law.weight else np.ones(len(x))
    line = np.ones((len(x), 1)) if law.weight else x[:, None]
    bend = bend_root(x)
    roots, labels = [], []
    for b in BENDS:
        own = np.hstack([line, b * bend]) * slope[:, None]
        roots += [s * own for s in SIZES]
        labels += list(SIZES)
    return Shape(FREE, np.array(labels), np.array(roots), weight=float(weight))


def bend_root(x: np.ndarray) -> np.ndarray:
    """Root (n, r) of the squared exponential of the distances of scaled states (n,)."""
    levels, place = np.unique(np.round(x, 9), return_inverse=True)
    values, vectors = np.linalg.eigh(bend(levels, levels))
    kept = values > 1e-6 * values.max()
    return (vectors[:, kept] * np.sqrt(values[kept]))[place]


def bend(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Squared exponential (n, m) of the distances of two scaled states."""
    return np.exp(-0.5 * ((x[:, None] - y[None, :]) / LENGTH) ** 2)
