"""One level of a lever that was set wrongly: 120 mm that were 132 mm."""

from collections.abc import Mapping

import numpy as np

from diagnosis.laws.known import Known
from diagnosis.laws.readings import SHAPE, Readings
from diagnosis.table_model.term import ERROR, Term, random_term

UNLIKELY = -2.0
"""Log prior odds where the reading does not go with the lever: a wrong size shows only through a
law."""


def terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """A term for each lever with three levels or more; its shapes are its levels."""
    out = []
    for lever, levels in readings.folds.items():
        several = [k for k, index in enumerate(levels) if len(index) > 1]
        if len(levels) < 3 or not several:
            continue
        value, n = readings.levers[lever], len(readings.log)
        shapes = []
        for k in several:
            root = np.zeros((n, 1))
            root[levels[k]] = 1.0
            name = f"{value[levels[k][0]]:g}"
            shapes.append(random_term(root, name, weight=-np.log(len(several))))
        weight = 0.0 if SHAPE.get(readings.experiment) == lever else UNLIKELY
        out.append(
            Term(readings.experiment, ERROR, f"{readings.experiment}:one level of {lever}",
                 tuple(shapes), weight, of=lever, what="one level")
        )  # fmt: skip
    return out
