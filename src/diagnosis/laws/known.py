"""The catalogue's mechanisms as curves over the settings of one experiment, from the engine's own
contacts.

A curve is what the mechanism at one strength does to the logarithm of the reading. Its base
coefficient is chosen so that the mean over the settings is that of the data. Settings of one grain
size share a simulation.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from diagnosis.catalogue import Mechanism
from diagnosis.collision import rebounds, sliding_angles
from diagnosis.laws.readings import IN_AIR, Readings, from_log, to_log

STEPS, CURVES = 11, 21
"""Strengths at which the engine is asked, and between which the curves are interpolated."""

SECANTS = 2
LATTICE = 0.015  # of the logarithm of a coefficient; what is left of it the level takes up
COEFFICIENT = {"drop": ("restitution", 0.03, 1.0), "tilt": ("static_friction", 0.005, 5.0)}
NO_COEFFICIENT = {"viscoelastic_restitution"}


@dataclass(frozen=True)
class Known:
    """A mechanism of the catalogue in one experiment: what it adds to the logarithms of readings
    about their centre, curves (k, n), at coded strengths label (k,); place: (slot, state);
    own_level: whether it has no base coefficient, so that the curves hold the level too."""

    name: str
    place: tuple
    label: np.ndarray
    curves: np.ndarray
    own_level: bool


def known_curves(
    catalogue: Mapping[str, Mechanism], spec_of: Callable[[str, dict[str, float]], dict[str, Any]]
) -> Callable[[Readings], dict[str, Known]]:
    """A function of readings that gives {name: Known} of every mechanism of the experiment.

    spec_of: (experiment, levers) -> run spec (a mapping) of a condition.
    """

    def make(readings):
        if readings.experiment not in COEFFICIENT:
            return {}
        out = {}
        for mechanism in catalogue.values():
            if readings.experiment not in mechanism.experiments or mechanism.law is None:
                continue
            found = _known(mechanism, readings, spec_of)
            if found is not None:
                out[mechanism.name] = found
        return out

    return make


def _known(mechanism, readings, spec_of):
    coded, centre = np.linspace(0.0, 1.0, STEPS), readings.centre
    rows = [_curve(mechanism, float(c), readings, centre, spec_of) for c in coded]
    good = [i for i, r in enumerate(rows) if r is not None]
    if len(good) < 3:
        return None
    fine = np.linspace(coded[good[0]], coded[good[-1]], CURVES)
    curves = CubicSpline(coded[good], np.array([rows[i] for i in good]))(fine)
    if np.ptp(curves - curves.mean(1, keepdims=True), axis=0).max() < 1e-4:
        return None  # it does not show on these levers
    own_level = mechanism.name in NO_COEFFICIENT
    slot, state = mechanism.law
    return Known(mechanism.name, (slot, tuple(state)), fine, curves, own_level)


def _curve(mechanism, coded, readings, centre, spec_of):
    """(n,) logarithms less the centre at a coded strength, or None where no coefficient meets the
    data's mean."""
    strength = float(mechanism.strength.natural(coded))
    if mechanism.observe is not None:
        return observed_log(mechanism, strength, centre, readings) - centre
    name, low, high = COEFFICIENT[readings.experiment]
    target = LATTICE * round(float(centre.mean()) / LATTICE)
    power = IN_AIR if readings.experiment == "drop" else 1.0
    value = _on_lattice(target / power, low, high)
    for _ in range(1 if mechanism.name in NO_COEFFICIENT else SECANTS):

        def switched(spec, value=value):
            return mechanism.apply(with_coefficient(spec, name, value), strength)

        log = contact_logs(switched, readings, spec_of)
        if not np.isfinite(log).all():
            return None
        miss = target - float(log.mean())
        moved = _on_lattice(np.log(value) + miss / power, low, high)
        if moved == value:
            break
        value = moved
    if mechanism.name in NO_COEFFICIENT:
        return log - centre
    # the engine without it has trends of its own, such as the slip after which a slide is seen
    own = log - contact_logs(lambda s: with_coefficient(s, name, value), readings, spec_of)
    return own - own.mean()


def observed_log(
    mechanism: Mechanism, strength: float, log: np.ndarray, readings: Readings
) -> np.ndarray:
    """(n,) logarithms of what would have been read in place of true values with logarithms (n,)."""
    true = from_log(readings.experiment, log, readings.levers)
    given = [
        {k: float(v[i]) for k, v in readings.levers.items() if not np.isnan(v[i])}
        for i in range(len(true))
    ]
    seen = [mechanism.observe(t, c, strength) for t, c in zip(true, given, strict=True)]  # type: ignore[misc]
    return to_log(readings.experiment, np.array(seen, float), readings.levers)[0]


def _on_lattice(log, low, high):
    """A coefficient near exp(log) that other data sets have, too, so that its contacts are computed
    once."""
    return float(np.clip(np.exp(LATTICE * round(log / LATTICE)), low, high))


def with_coefficient(spec: dict[str, Any], name: str, value: float) -> dict[str, Any]:
    """Run spec (a mapping) with a coefficient of grains on the plate."""
    pair = spec.get("contacts", {})
    wall = pair.get("particle_wall", {}) | {name: round(float(value), 9)}
    return spec | {"contacts": pair | {"particle_wall": wall}}


def contact_logs(
    switched: Callable[[dict[str, Any]], dict[str, Any]],
    readings: Readings,
    spec_of: Callable[[str, dict[str, float]], dict[str, Any]],
) -> np.ndarray:
    """(n,) logarithms of what the engine's one contact reads at each setting.

    switched: run spec (a mapping) -> the one with the laws to be run."""
    levers = readings.levers
    sizes = levers.get("particle_diameter_mm", np.full(len(readings.log), np.nan))
    out = np.empty(len(sizes))
    for size in np.unique(sizes):
        rows = np.flatnonzero((sizes == size) | (np.isnan(sizes) & np.isnan(size)))
        lever = "drop_height_mm" if readings.experiment == "drop" else "tilt_rate_deg_s"
        along = levers.get(lever, np.full(len(sizes), 5.0))[rows]
        given = {} if np.isnan(size) else {"particle_diameter_mm": float(size)}
        spec = switched(spec_of(readings.experiment, given | {lever: float(along[0])}))
        values, place = np.unique(along, return_inverse=True)
        text = json.dumps(spec, sort_keys=True)
        read = np.array(_asked(readings.experiment, text, tuple(values)))[place]
        with np.errstate(divide="ignore"):
            part = {k: v[rows] for k, v in levers.items()}
            out[rows] = to_log(readings.experiment, read, part)[0]
    return out


@lru_cache(maxsize=20000)
def _asked(experiment, text, values):
    spec = json.loads(text)
    return tuple((rebounds if experiment == "drop" else sliding_angles)(spec, np.array(values)))
