"""The diagnosis of drops and slides alone: each is one contact, which the engine integrates, so
nothing is trained.

The base model is a constant restitution and a constant friction. What it misses is looked for by
`diagnosis.laws`."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.statistics.numbers import NORMAL_95
from calibration.study.factors import Factor
from diagnosis.catalogue import Mechanism
from diagnosis.laws.engine_gain import Engine, compared, gain_of, not_run
from diagnosis.laws.known import known_curves
from diagnosis.laws.readings import EXPONENT, FREE, from_log, readings_of
from diagnosis.residuals import calibrated, residual_rows
from diagnosis.rig import Rig
from diagnosis.rules import OF_CONTACTS, by_runs, without_names
from diagnosis.settings import Settings, of_run
from diagnosis.table_model.block import LEVEL_SD
from diagnosis.table_model.found import Found, discover, give_strengths
from diagnosis.table_model.law import limits
from diagnosis.verdict import of_found


def discovered(
    measurements: list[Measurement],
    rig: Rig,
    catalogue: Mapping[str, Mechanism],
    aside: Sequence[dict[str, Any]] = (),
) -> Found | None:
    """`diagnosis.table_model.found.Found` of the drops, slides and shear tests among the
    measurements, or None; aside: rows of readings that were set aside."""
    return discover(measurements, aside=aside, **asked(measurements, rig, catalogue))


def asked(
    measurements: list[Measurement], rig: Rig, catalogue: Mapping[str, Mechanism]
) -> dict[str, Any]:
    """What `discover` and `diagnosis.power.power` are told beside: the catalogue's curves, what
    rows may leave empty, and how it is decided."""
    return {
        "alpha": rig.settings.alpha,
        "seed": rig.settings.seed,
        "defaults": defaults_of(rig.settings, {m.experiment for m in measurements}),
        "known": known_curves(catalogue, Engine(rig, catalogue).spec_of),
    }


def with_engine(
    verdict: dict[str, Any],
    measurements: list[Measurement],
    found: Found,
    rig: Rig,
    catalogue: Mapping[str, Mechanism],
) -> dict[str, Any]:
    """Return what verdict.json says of a table of single contacts but for its residuals and
    calibration, after the engine's word: gains of each law and of all, names that they leave, and
    limits."""
    engine = Engine(rig, catalogue)
    give_strengths(found, catalogue)
    parts = []
    for block in found.selection.blocks.values():
        own = [row for row in verdict["laws"] if row["key"] in block.held]
        if not own:
            continue
        names = {row["key"]: row["names"][0] if row["names"] else None for row in own}
        by_key = compared(measurements, block, names, engine)
        parts.append(by_key[None])
        for row in own:
            row |= {"gain": gain_of([by_key[row["key"]]]), "engine": by_key[row["key"]].engine}
            if row["engine"] is None:
                row["not_run"] = not_run(row)
    if parts:
        verdict["gain"] = gain_of(parts)
    verdict = by_runs(without_names(verdict), OF_CONTACTS)
    verdict["exclusion"] = limits(found.selection.blocks, catalogue)
    return verdict


MAY_BE_EMPTY = {
    "drop": ("particle_diameter_mm",),
    "tilt": ("particle_diameter_mm", "tilt_rate_deg_s"),
}
"""Levers that a row may leave empty, by experiment."""


def defaults_of(settings: Settings, experiments: Iterable[str]) -> dict[str, dict[str, float]]:
    """{experiment: {lever: value}} of the levers that rows may leave empty, as a run has them."""
    out = {}
    for kind in set(experiments) & set(FREE):
        run = settings.experiments[kind].run or {}
        found = {lever: of_run(run, lever) for lever in MAY_BE_EMPTY.get(kind, ())}
        out[kind] = {lever: value for lever, value in found.items() if value is not None}
    return out


def findings(
    measurements: list[Measurement], found: Found, settings: Settings, factors: Sequence[Factor]
) -> dict[str, Any]:
    """The mapping of verdict.json from a `Found`, the engine's word left open.

    The constants are fitted without the single rows that were found."""
    aside = {r["setting"] for r in found.rows}
    fitted = [m for i, m in enumerate(measurements) if i not in aside]
    calibration: dict[str, Any] = {}
    values = np.empty((3, len(measurements)))
    for kind in dict.fromkeys(m.experiment for m in fitted):
        log, error = _constant(fitted, kind)
        calibration |= _calibrated(settings, factors, kind, log, error)
        own = readings_of(measurements, kind)
        value = from_log(kind, np.full(len(own.log), log), own.levers)
        values[:, own.rows] = value, own.error * value, (own.log - log) / own.error
    columns = dict(zip(("predicted", "sd", "standardised"), values, strict=True))
    return of_found(found, settings.alpha) | {
        "calibration": calibration,
        "residuals": residual_rows(measurements, **columns),
        "lack_of_fit": found.misfit,
    }


def with_law(residuals: Sequence[Mapping[str, Any]], found: Found) -> np.ndarray | None:
    """Values (n,) that the laws found predict, or None without one; those of the constant, as the
    residuals have them, where they say nothing."""
    if not found.laws:
        return None
    value = np.array([row["predicted"] for row in residuals])
    for kind, block in found.selection.blocks.items():
        if block.held:
            mean = block.expected()[0]
            value[block.readings.rows] = from_log(kind, mean, block.readings.levers)
    return value


def _constant(measurements, kind):
    """(logarithm of the best constant of an experiment, its standard error)."""
    readings = readings_of(measurements, kind)
    weight = readings.error**-2.0
    level = float((weight * readings.log).sum() / weight.sum())
    return level, float((weight.sum() + LEVEL_SD**-2) ** -0.5)


def _calibrated(settings, factors, kind, log, error):
    """The base model's coefficient by its name; one beyond the range of the factors' table is said
    and kept as measured."""
    key, power = settings.experiments[kind].parameters[0], EXPONENT[kind]
    factor = next(f for f in factors if f.key == key)
    logs = log, log - NORMAL_95 * error, log + NORMAL_95 * error
    value, low, high = (float(np.exp(each / power)) for each in logs)
    high = min(high, 1.0) if kind == "drop" else high
    beyond = not factor.low <= value <= factor.high
    own = value, value * error / power, low, high, error / LEVEL_SD
    return {factor.name: calibrated(key, *own, beyond)}
