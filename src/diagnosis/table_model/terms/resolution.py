"""Readings that were rounded: their digits end on multiples of a step."""

from collections.abc import Mapping

import numpy as np

from diagnosis.laws.known import Known
from diagnosis.laws.readings import SHAPE, Readings
from diagnosis.table_model.term import ERROR, Shape, Term

LIKELY = 3.0
"""Log prior odds where the digits show the step, against a law."""

LEAST_SHARE = 0.3
"""Share of the median error below which a step adds nothing."""


def terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """One term where every reading is a multiple of a step. What rounding takes off is alike for
    readings that were rounded to one value, if they stand for one."""
    step = readings.step
    if step is None:
        return []
    share = rounded_off(readings)
    if np.median(share / readings.error) < LEAST_SHARE:
        return []
    rows = share[:, None]
    single = np.diag(share)
    shared = [rows * _same(code) for code in _codes(readings)]
    roots = [single, *shared, *(np.sqrt(0.5) * np.hstack([single, r]) for r in shared)]
    weight = -np.log(len(roots))
    shapes = tuple(Shape("rounded", np.array([step]), r[None], weight=weight) for r in roots)
    key = f"{readings.experiment}:resolution"
    return [
        Term(readings.experiment, ERROR, key, shapes, LIKELY, of="resolution", more={"step": step})
    ]


def rounded_off(readings: Readings) -> np.ndarray:
    """Standard deviation (n,) of what rounding to the readings' step takes off a logarithm."""
    return readings.step / np.sqrt(12.0) / np.abs(readings.values) * np.abs(readings.relative)


def _codes(readings):
    """Codes (n,) of readings that rounding takes the same from: of one value, and of one true
    value as a constant coefficient has it."""
    lever = readings.levers.get(SHAPE.get(readings.experiment))
    true = np.zeros(len(readings.log)) if lever is None else lever
    return [np.unique(v, return_inverse=True)[1] for v in (readings.values, true)]


def _same(code):
    return (code[:, None] == np.arange(code.max() + 1)).astype(float)
