"""Single readings that contradict the other readings of their own condition.

Where a table holds each reading, one that is far off widens the spread of its condition and hides
there. Distances from the condition's median are compared with the usual one of the experiment
(median absolute deviation: Hampel 1974, J. Am. Stat. Assoc. 69:383).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.intake.quantities import QUANTITIES
from diagnosis.reading_errors import spread_unit

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement


LEAST = 4  # readings of a condition
FAR = 7.0  # usual standard deviations
TO_NORMAL = 1.4826  # of the median absolute deviation of a normal law


def set_aside(
    measurements: Sequence[Measurement],
) -> tuple[list[Measurement], list[dict[str, Any]]]:
    """The measurements without such readings, and rows of verdict.json that point at them."""
    kept, rows = list(measurements), []
    for kind in dict.fromkeys(m.experiment for m in measurements):
        own = [i for i, m in enumerate(measurements)
               if m.experiment == kind and len(m.readings) >= LEAST]  # fmt: skip
        if len(own) < 2:
            continue
        unit = spread_unit([measurements[i] for i in own])
        off = [(np.array(measurements[i].readings) - np.median(measurements[i].readings)) / u
               for i, u in zip(own, unit, strict=True)]  # fmt: skip
        # the median of few readings lies too near to them
        shrunk = [o * np.sqrt(len(o) / (len(o) - 1.0)) for o in off]
        usual = TO_NORMAL * float(np.median(np.abs(np.concatenate(shrunk))))
        for i, distance in zip(own, shrunk, strict=True):
            worst = int(np.argmax(np.abs(distance)))
            if usual > 0.0 and abs(distance[worst]) > FAR * usual:
                kept[i] = _without(measurements[i], worst)
                rows.append(_row(measurements[i], i, worst, distance[worst] / usual))
    return kept, rows


def _without(m, place):
    values = tuple(v for k, v in enumerate(m.readings) if k != place)
    sd = max(stdev(values), 1e-9 * abs(values[0]))
    lines = tuple(v for k, v in enumerate(m.lines) if k != place)
    return replace(m, value=fmean(values), sd=sd, n=len(values), readings=values, lines=lines)


def _row(m, setting, place, off):
    line = m.lines[place] if m.lines else m.line
    value, others = m.readings[place], np.median(m.readings)
    words = QUANTITIES[m.experiment].words
    return {
        "experiment": m.experiment,
        "line": line,
        "levers": m.levers,
        "value": float(value),
        "standard_deviations": float(off),
        "expected": float(others),
        "setting": None,
        "reads_like": None,
        "sentence": f"Line {line}: a single reading of the {words} ({value:.4g}) lies "
        f"{abs(off):.0f} standard deviations from the others of its condition ({others:.4g}); it "
        "was left out.",
        "of_condition": setting,
    }
