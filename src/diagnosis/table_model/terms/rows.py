"""Single rows that contradict all others."""

from collections.abc import Mapping

import numpy as np

from diagnosis.laws.known import Known
from diagnosis.laws.readings import Readings
from diagnosis.table_model.term import ROW, Term, random_term

LEAST = 5  # readings of an experiment
SIZES = np.geomspace(0.02, 1.5, 7)


def terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """One term for each row, all together as probable as a law."""
    n = len(readings.log)
    if n < LEAST:
        return []
    out = []
    for i in range(n):
        root = np.zeros((n, 1))
        root[i] = 1.0
        key = f"{readings.experiment}:row {i}"
        shape = random_term(root, "row", SIZES)
        out.append(Term(readings.experiment, ROW, key, (shape,), -np.log(n), rows=(i,)))
    return out
