"""Rows that no fit has used, beside what was predicted of them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from diagnosis.bulk import Bulk
from diagnosis.fit import data_of
from diagnosis.laws.readings import from_log, readings_of, shared_covariance, unknown
from diagnosis.table_model.block import ROW, Held
from diagnosis.table_model.found import Found
from diagnosis.table_model.selection import blocks_of, held_in_turn


def by_emulators(
    bulk: Bulk, held_out: list[Measurement], models: Mapping[str, Sequence[str]]
) -> list[dict[str, Any]]:
    """Rows (see `_rows`) of conditions held out, by models {label: names of mechanisms}.

    An experiment of which nothing was fitted has no prediction. What is known of the error of a
    row's batch and instrument counts."""
    measurements = bulk.measurements
    place = [i for i, m in enumerate(held_out) if m.experiment in bulk.kinds]
    # the parameters of a model are those of all its experiments
    rows = measurements + [held_out[i] for i in place]
    together = [(m.experiment, m.levers) for m in rows]
    predicted = {}
    for label, names in models.items():
        _, fitted = bulk.fit(names)
        value, error = np.full(len(held_out), np.nan), np.zeros(len(held_out))
        found = bulk.emulated.model(together, names).predict(fitted.theta[:1])
        value[place], error[place] = (v[0, len(measurements) :] for v in found)
        more, variance = _shared(shared_covariance(rows, found[0][0], bulk.shared), fitted)
        value[place] += more
        error[place] = np.hypot(error[place], np.sqrt(variance))
        predicted[label] = value, error
    return _rows(held_out, predicted) if held_out else []


def _shared(covariance, fitted):
    """Return what errors of batches and instruments are expected to add (k,) to rows that were held
    out, and its variance. covariance: of these errors, the rows held out last."""
    n = fitted.predicted.shape[1]
    cross = covariance[n:, :n]
    total = covariance[:n, :n] + np.diag(fitted.sd[0] ** 2)
    left = covariance[n:, n:] - cross @ np.linalg.solve(total, cross.T)
    return cross @ (fitted.residual[0] / fitted.sd[0]), np.maximum(np.diag(left), 0.0)


def by_contacts(
    measurements: list[Measurement],
    held_out: Sequence[Measurement],
    found: Found,
    defaults: Mapping[str, Mapping[str, float]],
) -> list[dict[str, Any]]:
    """The same of single contacts: by a constant, and by the terms of a `Found`."""
    if not held_out:
        return []
    shape = len(held_out)
    before, after = ((np.full(shape, np.nan), np.zeros(shape)) for _ in range(2))
    for kind, block in found.selection.blocks.items():
        place = [i for i, m in enumerate(held_out) if m.experiment == kind]
        if not place:
            continue
        own = [m for m in measurements if m.experiment == kind]
        rows = own + [held_out[i] for i in place]
        for out, held in ((before, {}), (after, block.held)):
            value, error = predicted(rows, len(own), kind, held, defaults.get(kind))
            out[0][place], out[1][place] = value, error
    extended = any(b.held for b in found.selection.blocks.values())
    return _rows(held_out, {"before": before} | ({"after": after} if extended else {}))


def predicted(
    rows: Sequence[Measurement],
    known: int,
    kind: str,
    held: Mapping[str, Held],
    defaults: Mapping[str, float] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Values and errors of the readings from number `known` on, by the others and what is `held`
    {key: Held} in a block of them alone. Both (m,), in the quantity's unit."""
    readings = unknown(readings_of(rows, kind, defaults), np.arange(known, len(rows)))
    [bare] = blocks_of([readings], None).values()
    block = held_in_turn(bare, (key for key, h in held.items() if h.term.kind != ROW))
    mean, variance = block.expected()
    value = from_log(kind, mean, readings.levers)
    step = 1e-4
    moved = from_log(kind, mean + step, readings.levers)
    sd = np.sqrt(variance) * np.abs(moved - value) / step
    return value[known:], sd[known:]


def _rows(held_out, predicted):
    """[{experiment, line, levers, measured, error, before, after, miss_before, miss_after}]; after
    and its miss are null without an extended model. Misses are in errors of reading and prediction
    together."""
    out, error = [], data_of(held_out).error[0]
    for i, m in enumerate(held_out):
        row = {"experiment": m.experiment, "line": m.line, "levers": m.levers}
        row |= {"measured": m.value, "error": float(error[i])}
        for label in ("before", "after"):
            value, spread = (v[i] for v in predicted.get(label, ([np.nan] * (i + 1),) * 2))
            good = np.isfinite(value)
            row[label] = float(value) if good else None
            miss = (m.value - value) / np.hypot(error[i], spread) if good else None
            row[f"miss_{label}"] = None if miss is None else float(miss)
        out.append(row)
    return out
