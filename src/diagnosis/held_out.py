"""Rows that no fit has used, beside what was predicted of them, and the prediction that can fail.

It is of one further reading, with the cause and without: in another experiment where the cause
shows there, else at a setting beyond the plan. Rows with the role `hold out` decide it.
"""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS
from diagnosis.fit import Data, Fit, data_of
from diagnosis.laws.engine_gain import Engine
from diagnosis.laws.known import COEFFICIENT, contact_logs, with_coefficient
from diagnosis.laws.readings import EXPONENT, from_log, readings_of, unknown, with_setting
from diagnosis.model import Emulated
from diagnosis.next_measurement import BEYOND, DECIMALS
from diagnosis.page.words import told
from diagnosis.reading_errors import covariance_of, spread_unit
from diagnosis.table_model.block import ROW, Block, Held
from diagnosis.table_model.found import Found
from diagnosis.table_model.selection import blocks_of, held_in_turn


def by_emulators(
    emulated: Emulated,
    measurements: list[Measurement],
    held_out: list[Measurement],
    fits: Mapping[str, tuple[Sequence[str], Fit]],
    data: Data,
) -> list[dict[str, Any]]:
    """Rows (see `_rows`) of conditions held out, from {label: (names of mechanisms, Fit)} of the
    `Data` of the measurements.

    An experiment of which nothing was fitted has no prediction. What is known of the error of a
    row's batch and instrument counts."""
    kinds = {m.experiment for m in measurements}
    place = [i for i, m in enumerate(held_out) if m.experiment in kinds]
    # the parameters of a model are those of all its experiments
    together = [(m.experiment, m.levers) for m in measurements + [held_out[i] for i in place]]
    predicted = {}
    for label, (names, fitted) in fits.items():
        value, error = np.full(len(held_out), np.nan), np.zeros(len(held_out))
        found = emulated.model(together, names).predict(fitted.theta[:1])
        value[place], error[place] = (v[0, len(measurements) :] for v in found)
        more, variance = _shared(measurements, [held_out[i] for i in place], fitted, data)
        value[place] += more
        error[place] = np.hypot(error[place], np.sqrt(variance))
        predicted[label] = value, error
    return _rows(held_out, predicted) if held_out else []


def _shared(measurements, held_out, fitted, data):
    """Return what errors of batches and instruments are expected to add (k,) to rows that were held
    out, and its variance."""
    rows, n = measurements + held_out, len(measurements)
    covariance = covariance_of(rows, spread_unit(rows), fitted.shared_errors(data))
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


TYPICAL = 0.6
"""Restitution or friction of an experiment of which nothing was fitted."""

DECIDED = 2.0
"""Differences of squared misses, in squared errors, from which held-out rows decide."""


def prediction_test(
    verdict: Mapping[str, Any],
    measurements: Sequence[Measurement],
    found: Found,
    engine: Engine,
    held_out: Sequence[Measurement] = (),
) -> dict[str, Any] | None:
    """{experiment, levers, with_cause, without_cause, sd, by, text, outcome, rows} of a verdict of
    single contacts; None where nothing was placed.

    by: `engine` or `curve`; outcome: `open`, or by rows that were held out `confirmed`, `refuted`
    or `undecided`."""
    placed = verdict["laws"] or [e for e in verdict["errors"] if e["what"] not in
                                 ("declared", "settings")]  # fmt: skip
    if not placed:
        return _again(verdict) if verdict["rows"] else _constant(found, verdict)
    row = placed[0]
    own, decided = _elsewhere(row, verdict, measurements, engine, held_out)
    own = own or _beyond(row, found)
    if own is None:
        return None
    rows = decided or _here(measurements, found, held_out)
    return _told(own | {"cause": row["key"], "outcome": _outcome(rows), "rows": rows})


def _told(test):
    """The test with its sentence."""
    return test | {"text": told("prediction_test.j2", test=test)}


def _again(verdict):
    """The worst of the rows that were pointed at, read again."""
    row = verdict["rows"][0]
    own = {"experiment": row["experiment"], "levers": row["levers"], "by": "curve", "rows": []}
    own |= {"with_cause": row["expected"], "without_cause": row["value"], "sd": None}
    return _told(own | {"cause": "row", "outcome": "open"})


def _constant(found, verdict):
    """Return what a constant coefficient expects beyond the plan; None where nothing is
    adequate."""
    if verdict["verdict"] != "adequate":
        return None
    block = next(iter(found.selection.blocks.values()))
    settings = _settings(block)
    if not settings:
        return None
    kind, levers = block.readings.experiment, settings[0]
    wider = with_setting(block.readings, levers)
    mean, variance = (v[-1] for v in Block(wider, {}, {}).expected())
    sd = np.hypot(np.sqrt(variance), np.median(block.readings.error))
    value, more = from_log(kind, np.array([mean, mean + sd]), levers).tolist()
    own = {"experiment": kind, "levers": levers, "by": "curve", "rows": [], "outcome": "open"}
    own |= {"with_cause": None, "without_cause": value, "sd": abs(more - value), "cause": None}
    return _told(own)


def _elsewhere(row, verdict, measurements, engine, held_out):
    """The prediction in another experiment that the named mechanism shows in and that the rig has,
    by the engine, and the misses of the rows held out there; (None, []) without one."""
    name = row.get("single") or next(iter(row.get("names", ())), None)
    if name is None or verdict["verdict"] not in ("identified", "discovered", "ambiguous"):
        return None, []
    mechanism = engine.catalogue[name]
    strength = row.get("strengths", {}).get(name)
    if strength is None or mechanism.observe is not None:
        return None, []
    for kind in mechanism.experiments:
        if kind == row["experiment"] or kind not in COEFFICIENT:
            continue
        if kind not in engine.rig.settings.experiments:
            continue
        logs = _switched(kind, mechanism, strength, measurements, engine)
        return _by_engine(kind, logs, measurements), _there(kind, logs, measurements, held_out)
    return None, []


def _switched(kind, mechanism, strength, measurements, engine):
    """A function of `Readings` of an experiment that gives (on, off), each (n,) logarithms of what
    the engine's one contact reads with a mechanism and without."""
    coefficient, low, high = COEFFICIENT[kind]
    own, value = [m for m in measurements if m.experiment == kind], TYPICAL
    if own:
        centre = readings_of(own, kind, {}).centre[0]
        value = float(np.clip(np.exp(centre / EXPONENT[kind]), low, high))

    def off(spec):
        return with_coefficient(spec, coefficient, value)

    def on(spec):
        return mechanism.apply(off(spec), strength)

    return lambda readings: [contact_logs(f, readings, engine.spec_of) for f in (on, off)]


def _by_engine(kind, logs_of, measurements):
    """On and off in another experiment, at the size at which they differ most."""
    sizes = sorted({m.levers.get("particle_diameter_mm") for m in measurements} - {None})
    fixed = {"drop_height_mm": 50.0} if kind == "drop" else {"tilt_rate_deg_s": 5.0}
    best = None
    for size in sizes or [None]:
        levers = ({} if size is None else {"particle_diameter_mm": size}) | fixed
        values = {k: np.array([v]) for k, v in levers.items()}
        # one setting, as `contact_logs` takes it
        at = SimpleNamespace(experiment=kind, levers=values, log=np.zeros(1))
        on, off = logs_of(at)
        apart = abs(on[0] - off[0])
        if np.isfinite(apart) and (best is None or apart > best[0]):
            best = apart, levers, np.array([on[0], off[0]])
    if best is None:
        return None
    _, levers, logs = best
    on, off = from_log(kind, logs, levers).tolist()
    return {"experiment": kind, "levers": levers, "with_cause": on, "without_cause": off,
            "sd": None, "by": "engine"}  # fmt: skip


def _there(kind, logs_of, measurements, held_out):
    """[{line, miss_with, miss_without}] of the rows held out in another experiment. The constant of
    each comes from the rows that were fitted there, or where there are none from those held out: of
    these the differences alone decide."""
    own = [m for m in held_out if m.experiment == kind]
    fitted = [m for m in measurements if m.experiment == kind]
    if not own or (not fitted and len(own) < 2):
        return []
    readings = readings_of(fitted + own, kind, {})
    used = np.arange(len(fitted)) if fitted else np.arange(len(own))
    weight = 1.0 / readings.error[used] ** 2
    out = [{"line": m.line} for m in own]
    for label, logs in zip(("miss_with", "miss_without"), logs_of(readings), strict=True):
        left = readings.log - logs
        left -= (weight * left[used]).sum() / weight.sum()
        sd = np.hypot(readings.error, weight.sum() ** -0.5) if fitted else readings.error
        for row, miss in zip(out, (left / sd)[-len(own) :], strict=True):
            row[label] = float(miss)
    finite = [r for r in out if np.isfinite([r["miss_with"], r["miss_without"]]).all()]
    return finite if len(finite) == len(out) else []


def _beyond(row, found):
    """With the cause and without at a setting of the same experiment beyond the plan, or between
    its levels: that at which they differ most, in errors of the prediction."""
    block = found.selection.blocks[row["experiment"]]
    best = None
    for levers in _settings(block):
        [bare] = blocks_of([with_setting(block.readings, levers)], None).values()
        model = held_in_turn(bare, block.held)
        if row["key"] not in model.held:
            return None
        mean, variance = (v[-1] for v in model.expected())
        less, other = (v[-1] for v in model.without(row["key"]).expected())
        apart = abs(mean - less) / np.sqrt(variance + other + np.median(block.readings.error) ** 2)
        if best is None or apart > best[0]:
            best = apart, levers, (mean, less, mean + np.sqrt(variance))
    if best is None:
        return None
    _, levers, logs = best
    kind = row["experiment"]
    on, off, more = from_log(kind, np.array(logs), levers).tolist()
    return {"experiment": kind, "levers": levers, "with_cause": on, "without_cause": off,
            "sd": abs(more - on), "by": "curve"}  # fmt: skip


def _settings(block):
    readings, out = block.readings, []
    middle = {n: float(np.nanmedian(v)) for n, v in readings.levers.items() if np.isfinite(v).any()}
    for name in readings.folds:
        known = np.unique(readings.levers[name])
        known = known[np.isfinite(known) & (known > 0.0)]
        if len(known) < 2:
            continue
        ends = (known[0] / BEYOND, known[-1] * BEYOND, *np.sqrt(known[1:] * known[:-1]))
        for value in ends:
            value = float(f"{value:.{DECIMALS}g}")
            if LEVERS[name].least <= value <= LEVERS[name].most:
                out.append(middle | {name: value})
    return out


def _here(measurements, found, held_out):
    """[{line, miss_with, miss_without}] of the rows held out of experiments in which something was
    found, in errors of reading and prediction together."""
    kinds = [kind for kind, block in found.selection.blocks.items() if block.held]
    own = [m for m in held_out if m.experiment in kinds]
    return [
        {"line": r["line"], "miss_with": r["miss_after"], "miss_without": r["miss_before"]}
        for r in by_contacts(measurements, own, found, {})
        if r["miss_after"] is not None
    ]


def _outcome(rows):
    """Return what rows that were held out decide."""
    if not rows:
        return "open"
    square = [sum(r[k] ** 2 for r in rows) for k in ("miss_with", "miss_without")]
    if square[1] - square[0] > DECIDED:
        return "confirmed"
    return "refuted" if square[0] - square[1] > DECIDED else "undecided"
