"""Two levels of a lever that were taken for each other."""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from diagnosis.laws.known import Known
from diagnosis.laws.readings import SHAPE, Readings
from diagnosis.table_model.term import ERROR, Shape, Term


def terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """A term of the lever that the reading goes with, where it has three levels or more; its shapes
    are the pairs. What the readings at one level lose those at the other gain."""
    lever = SHAPE.get(readings.experiment, "")
    levels = readings.folds.get(lever, ())
    if len(levels) < 3:
        return []
    value, n, shapes = readings.levers[lever], len(readings.log), []
    pairs = list(combinations(range(len(levels)), 2))
    for one, other in pairs:
        low, high = value[levels[one][0]], value[levels[other][0]]
        curve = np.zeros(n)
        curve[levels[one]], curve[levels[other]] = np.log(high / low), np.log(low / high)
        name, weight = f"{low:g} and {high:g}", -float(np.log(len(pairs)))
        shapes.append(Shape(name, np.ones(1), np.zeros((1, n, 1)), curve[None], weight))
    key = f"{readings.experiment}:exchanged {lever}"
    return [Term(readings.experiment, ERROR, key, tuple(shapes), of=lever, what="exchanged")]
