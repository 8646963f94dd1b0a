"""Rows that no fit has used, beside what the model of the table predicts of them."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from diagnosis.bulk import Bulk
from diagnosis.fit import data_of
from diagnosis.laws.readings import from_log, readings_of, unread
from diagnosis.table_model.block import ROW, Block
from diagnosis.table_model.found import Found
from diagnosis.table_model.selection import blocks_of, held_in_turn

STEP = 1e-4  # of a logarithm, for the derivative of the reading


def by_emulators(bulk: Bulk, held_out: Sequence[Measurement], found: Found) -> list[dict[str, Any]]:
    """Rows (see `_rows`) of conditions that were held out of a table of simulated tests."""
    place = [i for i, m in enumerate(held_out) if m.experiment in bulk.kinds]
    if not place:
        return _rows(held_out, place, 0, [], found)
    wider = Bulk(bulk.emulated, bulk.tested, beside=[unread(held_out[i]) for i in place])
    return _rows(held_out, place, len(bulk.measurements), wider.block().values(), found)


def by_contacts(
    measurements: Sequence[Measurement],
    held_out: Sequence[Measurement],
    found: Found,
    defaults: Mapping[str, Mapping[str, float]],
) -> list[dict[str, Any]]:
    """The same of single contacts."""
    place = [i for i, m in enumerate(held_out) if m.experiment in found.selection.blocks]
    rows = [*measurements, *(unread(held_out[i]) for i in place)]
    kinds = {held_out[i].experiment for i in place}
    blocks = blocks_of([readings_of(rows, kind, defaults.get(kind)) for kind in kinds], None)
    return _rows(held_out, place, len(measurements), blocks.values(), found)


def _rows(held_out, place, known, blocks, found):
    """[{experiment, line, levers, measured, error, before, after, miss_before, miss_after}] of rows
    that were held out. Those at `place` stand in blocks behind the `known` ones and are predicted
    by constant coefficients, and by what was found; what nothing predicts is null. Misses are in
    errors of reading and prediction together."""
    held = [k for b in found.selection.blocks.values() for k, h in b.held.items()
            if h.term.kind != ROW]  # fmt: skip
    shown = {"before": ()} | ({"after": held} if held else {})
    predicted = {label: np.full((2, len(held_out)), np.nan) for label in ("before", "after")}
    for (label, keys), block in product(shown.items(), blocks):
        for row, *told in _predicted(held_in_turn(block, keys), known):
            predicted[label][:, place[row]] = told
    out, error = [], data_of(held_out).error[0] if held_out else ()
    for i, m in enumerate(held_out):
        line = {"experiment": m.experiment, "line": m.line, "levers": m.levers}
        line |= {"measured": m.value, "error": float(error[i])}
        for label, own in predicted.items():
            value, sd = own[:, i]
            both = {label: value, f"miss_{label}": (m.value - value) / np.hypot(error[i], sd)}
            line |= {key: float(v) if np.isfinite(v) else None for key, v in both.items()}
        out.append(line)
    return out


def _predicted(block: Block, known: int) -> Iterable[tuple[int, float, float]]:
    """(place behind the known ones, value, standard deviation) of the rows of a block that weigh
    nothing, in the quantity's unit, with what is known of their batches and instruments."""
    mean, variance = block.expected(block.readings.groups)
    for kind in block.readings.experiments:
        own, at = block.readings.of(kind)
        value, moved = (from_log(kind, mean[at] + s, own.levers) for s in (0.0, STEP))
        sd = np.sqrt(variance[at]) * np.abs(moved - value) / STEP
        for k in np.flatnonzero(own.rows >= known):
            yield int(own.rows[k]) - known, float(value[k]), float(sd[k])
