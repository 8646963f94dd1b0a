"""The model fitted anew without some settings, and what it expects there."""

from dataclasses import replace
from typing import Any

import numpy as np

from diagnosis.laws.readings import unknown
from diagnosis.laws.slots import FreeLaw
from diagnosis.table_model.block import Block

LEAST_LEVELS = 3  # of a lever, to leave one out


def refitted(block: Block, index: np.ndarray) -> Block:
    """The block without the readings `index`, the strengths of what is held fitted anew, each in
    its form: the levels that are left may be too few to choose one. index: (k,) places of
    readings."""
    out = replace(block, readings=unknown(block.readings, index))
    for key in block.held:
        rest = out.without(key)
        form = replace(block.terms[key], shapes=(block.shape_of(key)[0],))
        out = rest.with_held(rest.held | {key: replace(rest.hold(form), term=block.terms[key])})
    return out


def levels_of(block: Block, law: FreeLaw | None) -> tuple[str | None, list[np.ndarray]]:
    """(lever, [indices]) of the levels to be left out together: of the lever that a law acts on, or
    of its covariate in thirds; single settings where it has too few."""
    readings = block.readings
    for name in law.needs if law else ():
        if len(readings.folds.get(name, ())) >= LEAST_LEVELS:
            return name, readings.folds[name]
        if name in readings.covariates:
            order = np.argsort(readings.covariates[name], kind="stable")
            return name, np.array_split(order, min(4, len(order)))
    return None, [np.array([i]) for i in range(len(readings.log))]


def judged(block: Block, key: str) -> dict[str, Any]:
    """{settings, before, after, beyond_band}: how left-out inner levels are missed (root mean
    square) without and with a law, in errors of the readings, and in all errors with it."""
    law, readings = block.terms[key].law, block.readings
    lever, levels = levels_of(block, law)
    inner = levels[1:-1] if lever else levels
    # nothing but its own readings tells a level that was set wrongly
    wrong = [h.root.any(1) for h in block.held.values() if h.term.what == "one level"]
    inner = [index for index in inner if not any(w[index].any() for w in wrong)]
    misses = []
    for index in inner:
        held = refitted(block, index)
        for label, b in (("after", held), ("before", held.without(key))):
            mean, variance = b.expected()
            off = readings.log[index] - mean[index]
            error = readings.error[index]
            names = (*readings.scatters, *readings.groups)
            shared = sum(b.sd_of(n)[index] ** 2 for n in names)
            whole = np.sqrt(error**2 + variance[index] + shared)
            misses += [(label, o / e, o / w) for o, e, w in zip(off, error, whole, strict=True)]
    if not misses:
        return {"settings": 0, "before": 0.0, "after": 0.0, "beyond_band": 0.0}

    def rms(label, column):
        return float(np.sqrt(np.mean([m[column] ** 2 for m in misses if m[0] == label])))

    return {
        "settings": len(misses) // 2,
        "before": rms("before", 1),
        "after": rms("after", 1),
        "beyond_band": rms("after", 2),
    }


def without_row(block: Block, key: str, place: int) -> tuple[float, float]:
    """(distance [sd], expected logarithm) of a row from what all others say."""
    rest = refitted(block.without(key) if key in block.held else block, np.array([place]))
    y = block.readings.log
    mean, variance = rest.expected()
    shared = sum(rest.sd_of(name)[place] ** 2 for name in block.readings.scatters)
    sd = np.sqrt(block.readings.error[place] ** 2 + variance[place] + shared)
    return float((y[place] - mean[place]) / sd), float(mean[place])
