"""A wrong zero of the lever that the reading goes with: all heights off by one length, all normal
stresses by one load."""

from collections.abc import Mapping

import numpy as np

from diagnosis.laws.forms import LADDER
from diagnosis.laws.known import Known
from diagnosis.laws.readings import SHAPE, Readings
from diagnosis.table_model.term import ERROR, Term, curve_shape


def terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """One term where the lever varies; its strengths are what is added, in the lever's unit."""
    lever = SHAPE.get(readings.experiment)
    if lever not in readings.folds:
        return []
    value = readings.levers[lever]
    shapes = []
    for shift in (-LADDER[LADDER < 0.95], LADDER):
        own = shift * value.min()
        curves = np.log1p(own[:, None] / value)
        shapes.append(curve_shape("zero", own, curves, weight=-np.log(2.0)))
    key = f"{readings.experiment}:zero of {lever}"
    return [Term(readings.experiment, ERROR, key, tuple(shapes), of=lever, what="zero")]  # type: ignore[arg-type]
