"""The readings of one experiment as the free laws see them: logarithms, their errors, and what
settings share.

A reading is taken as the logarithm of what the law multiplies: rebound height, tangent of the
sliding angle, shear stress. There an error of a laboratory is a share of the value, and a constant
restitution or friction is one level."""

from dataclasses import dataclass, replace

import numpy as np

from calibration.intake.quantities import LEVERS
from diagnosis.fit import moderated_sd

FREE = ("drop", "tilt", "shear")
"""Experiments whose model is one contact, or one ratio of stresses."""

SHAPE = {"drop": "drop_height_mm", "shear": "normal_stress_kPa"}
"""Lever that the reading of an experiment is proportional to, for constant coefficients."""

IN_AIR = 2.0  # a rebound is the square of a restitution


@dataclass(frozen=True)
class Readings:
    """n settings of one experiment.

    rows: (n,) their places among the measurements; levers: {name: (n,)}, nan where not set; log:
    (n,) logarithm of the reading over its shape; error: (n,) standard error of that; groups: {name:
    (n,) codes} of what settings share, levels of levers included; folds: {lever: [indices of a
    level]}; replicates: (n,) of each.
    """

    experiment: str
    rows: np.ndarray
    levers: dict
    log: np.ndarray
    error: np.ndarray
    groups: dict
    folds: dict
    replicates: np.ndarray

    def without(self, index):
        """These readings without the settings `index`."""
        kept = np.setdiff1d(np.arange(len(self.log)), index)
        levers = {k: v[kept] for k, v in self.levers.items()}
        groups = {k: v[kept] for k, v in self.groups.items() if k not in levers}
        return _with_levels(
            self.experiment,
            self.rows[kept],
            levers,
            self.log[kept],
            self.error[kept],
            groups,
            self.replicates[kept],
        )


UNKNOWN = 30.0
"""Median errors, and one of the logarithm, that a reading is given which is to be predicted: it
then weighs nothing."""


def unknown(readings, index):
    """The readings with those at `index` given such an error."""
    error = readings.error.copy()
    others = np.delete(error, index)
    error[index] = UNKNOWN * np.median(others) + 1.0
    return replace(readings, error=error)


def with_setting(readings, levers):
    """The readings with one more at {lever: value}, which weighs nothing."""
    wider = {n: np.append(v, levers.get(n, np.nan)) for n, v in readings.levers.items()}
    # a batch or an instrument of its own
    groups = {
        n: np.append(v, v.max() + 1) for n, v in readings.groups.items() if n not in readings.levers
    }
    log = np.append(readings.log, np.median(readings.log))
    error, rows = np.append(readings.error, 1.0), np.append(readings.rows, -1)
    n = np.append(readings.replicates, 1.0)
    more = _with_levels(readings.experiment, rows, wider, log, error, groups, n)
    return unknown(more, [len(log) - 1])


def readings_of(measurements, experiment, defaults=None):
    """`Readings` of one experiment's measurements; `defaults` {lever: value} where a row leaves a
    lever empty."""
    rows = np.array([i for i, m in enumerate(measurements) if m.experiment == experiment])
    own = [measurements[i] for i in rows]
    set_ = dict.fromkeys(name for m in own for name in m.levers)
    empty = defaults or {}
    levers = {
        name: np.array([m.levers.get(name, empty.get(name, np.nan)) for m in own], float)
        for name in (*set_, *(n for n in empty if n not in set_))
        if name in LEVERS
    }
    value = np.array([m.value for m in own])
    error = np.hypot(moderated_sd(own) / np.sqrt([m.n for m in own]), [m.lever_error for m in own])
    log, slope = to_log(experiment, value, levers)
    groups = {}
    for name in ("batch", "instrument"):
        labels = [getattr(m, name) for m in own]
        if len(set(labels)) > 1:
            groups[name] = np.unique(labels, return_inverse=True)[1]
    n = np.array([m.n for m in own], float)
    return _with_levels(experiment, rows, levers, log, error * slope, groups, n)


def _with_levels(experiment, rows, levers, log, error, groups, replicates):
    folds, groups = {}, dict(groups)
    for name, value in levers.items():
        level = np.unique(np.where(np.isnan(value), -1.0, value), return_inverse=True)[1]
        count = level.max() + 1
        if count < 2:
            continue
        folds[name] = [np.flatnonzero(level == k) for k in range(count)]
        # a level of its own for each setting is the error between settings
        if 3 <= count < len(log):
            groups[name] = level
    return Readings(experiment, rows, levers, log, error, groups, folds, replicates)


def to_log(experiment, value, levers):
    """Logarithm of a reading over its shape, and the derivative by the value."""
    value = np.asarray(value, float)
    if experiment == "tilt":
        angle = np.radians(value)
        return np.log(np.tan(angle)), np.radians(2.0 / np.sin(2.0 * angle))
    return np.log(value / levers[SHAPE[experiment]]), 1.0 / value


def from_log(experiment, log, levers):
    """The reading in its unit, of its logarithm over its shape."""
    if experiment == "tilt":
        return np.degrees(np.arctan(np.exp(log)))
    return np.exp(log) * levers[SHAPE[experiment]]
