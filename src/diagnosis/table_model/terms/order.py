"""A drift in the order of the rows: wear, a day that grows damp."""

from collections.abc import Mapping

import numpy as np

from diagnosis.laws.known import Known
from diagnosis.laws.readings import Readings
from diagnosis.table_model.term import ERROR, SIZES, Shape, Term
from diagnosis.table_model.terms.laws import bend_root

UNLIKELY = -3.0
"""Log prior odds: a table that is sorted by a lever need not stand in the order of the tests."""

BENDS = (0.0, 0.7)
LEAST = 5


def terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """One term of a line and a bend over the number of the row, or over its logarithm."""
    n = len(readings.log)
    if n < LEAST:
        return []
    order = np.argsort(np.argsort(readings.rows)).astype(float)
    shapes = []
    for name, at in (("even", order), ("at first", np.log1p(order))):
        x = 2.0 * (at - at.min()) / np.ptp(at) - 1.0
        bend = bend_root(x)
        roots = [s * np.hstack([x[:, None], b * bend]) for b in BENDS for s in SIZES]
        label = np.tile(SIZES, len(BENDS))
        shapes.append(Shape(name, label, np.array(roots), weight=-np.log(2.0)))
    key = f"{readings.experiment}:order"
    return [Term(readings.experiment, ERROR, key, tuple(shapes), UNLIKELY, of="order")]
