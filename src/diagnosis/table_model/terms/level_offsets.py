"""Each level of a lever set up with an error of its own: a camera that is set anew for each height,
a lot of grains for each size."""

from collections.abc import Mapping

import numpy as np

from diagnosis.laws.known import Known
from diagnosis.laws.readings import Readings
from diagnosis.table_model.term import ERROR, Term, random_term


def terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """One term for each lever with two levels or more, a level of its own for each reading
    excepted: that is the error from setting to setting."""
    out = []
    for lever, levels in readings.folds.items():
        if len(levels) == len(readings.log):
            continue
        root = np.zeros((len(readings.log), len(levels)))
        for k, index in enumerate(levels):
            root[index, k] = 1.0
        out.append(
            Term(readings.experiment, ERROR, f"{readings.experiment}:levels of {lever}",
                 (random_term(root),), of=lever, what="levels")
        )  # fmt: skip
    return out
