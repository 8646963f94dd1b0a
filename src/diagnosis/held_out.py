"""Rows that no fit has used, beside what the model of the table predicts of them."""

from collections.abc import Iterable, Mapping, Sequence
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
    own = [m for m in held_out if m.experiment in bulk.kinds]
    if not own:
        return _rows(held_out, 0, [], found)
    wider = Bulk(bulk.emulated, bulk.tested, beside=[*map(unread, own)])
    return _rows(held_out, len(bulk.measurements), wider.block().values(), found)


def by_contacts(
    measurements: Sequence[Measurement],
    held_out: Sequence[Measurement],
    found: Found,
    defaults: Mapping[str, Mapping[str, float]],
) -> list[dict[str, Any]]:
    """The same of single contacts."""
    own = [m for m in held_out if m.experiment in found.selection.blocks]
    rows = [*measurements, *map(unread, own)]
    kinds = {m.experiment for m in own}
    blocks = blocks_of([readings_of(rows, kind, defaults.get(kind)) for kind in kinds], None)
    return _rows(held_out, len(measurements), blocks.values(), found)


def _rows(held_out, known, blocks, found):
    """[{experiment, line, levers, measured, error, before, after, miss_before, miss_after}] of rows
    that stand in blocks behind the `known` ones, those of an experiment without a block left out:
    by constant coefficients, and by what was found; what nothing predicts is null. Misses are in
    errors of reading and prediction together."""
    held = [k for b in found.selection.blocks.values() for k, h in b.held.items()
            if h.term.kind != ROW]  # fmt: skip
    kinds = {kind for block in blocks for kind in block.readings.experiments}
    place = np.array([i for i, m in enumerate(held_out) if m.experiment in kinds], int)
    predicted = np.full((2, 2, len(held_out)), np.nan)
    for which, keys in enumerate(((), held) if held else ((),)):
        for block in blocks:
            for row, *told in _predicted(held_in_turn(block, keys), known):
                predicted[which, :, place[row]] = told
    out, error = [], data_of(held_out).error[0] if held_out else ()
    for m, own, values in zip(held_out, error, predicted.transpose(2, 0, 1), strict=True):
        line = {"experiment": m.experiment, "line": m.line, "levers": m.levers}
        line |= {"measured": m.value, "error": float(own)}
        for label, (value, sd) in zip(("before", "after"), values, strict=True):
            some = np.isfinite(value)
            line[label] = float(value) if some else None
            line[f"miss_{label}"] = float((m.value - value) / np.hypot(own, sd)) if some else None
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
