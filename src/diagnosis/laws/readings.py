"""The readings of one experiment as the free laws see them: logarithms, their errors, and what
settings share.

A reading is taken as the logarithm of what the law multiplies: rebound height, tangent of the
sliding angle, shear stress. There an error of a laboratory is a share of the value, and a constant
restitution or friction is one level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS
from diagnosis.reading_errors import LABELS, stated_sd

FREE = ("drop", "tilt", "shear")
"""Experiments whose model is one contact, or one ratio of stresses."""

SHAPE = {"drop": "drop_height_mm", "shear": "normal_stress_kPa"}
"""Lever that the reading of an experiment is proportional to, for constant coefficients."""

EXPONENT = {"drop": 2.0, "tilt": 1.0, "shear": 1.0}
"""Power of the coefficient that a reading goes with: a rebound is the square of a restitution."""


@dataclass(frozen=True)
class Readings:
    """n settings of one experiment.

    rows: (n,) their places among the measurements; levers: {name: (n,)}, nan where not set;
    covariates: {name: (n,)} of what was recorded beside and varies; log: (n,) logarithm of the
    reading over its shape; error: (n,) standard error of that, what all readings of a setting lose
    to rounding counted in; own: (n,) the same as if each lost something else; groups: {batch or
    instrument: (n,) codes, -1 without a label}; folds: {lever: [indices of a level]}; replicates:
    (n,) of each; values: (n,) as read; step: that readings are multiples of, or None; relative:
    (n,) derivative of `log` by the logarithm of the value; coarse: whether the step is coarser than
    the readings differ; parts: {experiment: (its `Readings`, their places)} of simulated readings.
    """

    experiment: str
    rows: np.ndarray
    log: np.ndarray
    error: np.ndarray
    own: np.ndarray
    groups: dict
    replicates: np.ndarray
    values: np.ndarray
    relative: np.ndarray
    levers: dict = field(default_factory=dict)
    covariates: dict = field(default_factory=dict)
    folds: dict = field(default_factory=dict)
    step: float | None = None
    coarse: bool = False
    parts: dict = field(default_factory=dict)

    def of(self, experiment: str) -> tuple["Readings", np.ndarray]:
        """The readings of one experiment, and their places (k,)."""
        return self.parts.get(experiment, (self, np.arange(len(self.log))))

    @property
    def experiments(self) -> list[str]:
        """The experiments of which readings there are."""
        return list(self.parts) or [self.experiment]

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """{name: (n,)} of levers and covariates, of which laws take their states."""
        return self.levers | self.covariates

    @property
    def usual(self) -> np.ndarray:
        """(n,) median error of a reading of its experiment, 0 of tests that ended without one."""
        out = np.zeros(len(self.log))
        for kind in self.experiments:
            own, at = self.of(kind)
            out[at] = np.median(own.error[own.error < 10.0])
        return out

    @property
    def scatters(self) -> dict[str, np.ndarray]:
        """{name: (n,) codes} of the errors from setting to setting, -1 where a reading has none."""
        out = {}
        for kind in self.experiments:
            code = out[self.name_of("settings", kind)] = np.full(len(self.log), -1)
            code[self.of(kind)[1]] = self.of(kind)[1]
        return out

    def name_of(self, error: str, experiment: str) -> str:
        """Name of an error that readings of an experiment share: of several each has its own."""
        return f"{error} of {experiment}" if self.parts else error

    @property
    def centre(self) -> np.ndarray:
        """(n,) logarithm of the best constant, alike at all settings."""
        return np.full(len(self.log), self.level(self.log))

    def level(self, log: np.ndarray) -> float:
        """Mean of logarithms (n,), weighted by the readings' errors."""
        weight = 1.0 / self.error**2
        return float((weight * log).sum() / weight.sum())


UNKNOWN = 30.0
"""Median errors, and one of the logarithm, that a reading is given which is to be predicted: it
then weighs nothing."""


def unknown(readings: Readings, index: np.ndarray | Sequence[int]) -> Readings:
    """The readings with those at `index` given such an error. index: (k,) places of settings."""
    error = readings.error.copy()
    others = np.delete(error, index)
    error[index] = UNKNOWN * np.median(others) + 1.0
    return replace(readings, error=error)


def unread(m: Measurement, **other: Any) -> Measurement:
    """The `Measurement` with another value of its fields, as one that weighs nothing."""
    return replace(m, sd=UNKNOWN * abs(m.value), n=1, **other)


def with_setting(
    readings: Readings, levers: Mapping[str, float], covariates: Mapping[str, float]
) -> Readings:
    """The readings with one more at {lever: value}, which weighs nothing; covariates stand at their
    medians unless given."""
    wider = {n: np.append(v, levers.get(n, np.nan)) for n, v in readings.levers.items()}
    beside = readings.covariates.items()
    more = {n: np.append(v, covariates.get(n, np.median(v))) for n, v in beside}
    # a batch or an instrument of its own
    groups = {n: np.append(v, v.max() + 1) for n, v in readings.groups.items()}
    last = {"rows": readings.rows.max() + 1, "error": 1.0, "own": 1.0, "replicates": 1.0}
    last |= {n: np.median(getattr(readings, n)) for n in ("log", "values", "relative")}
    own: dict[str, Any] = {n: np.append(getattr(readings, n), v) for n, v in last.items()}
    own |= {"levers": wider, "covariates": more, "groups": groups, "folds": folds_of(wider)}
    return unknown(replace(readings, **own), [len(readings.log)])


def readings_of(
    measurements: Sequence[Measurement],
    experiment: str,
    defaults: Mapping[str, float] | None = None,
) -> Readings:
    """`Readings` of one experiment's measurements; `defaults` {lever: value} where a row leaves a
    lever empty."""
    rows = np.array([i for i, m in enumerate(measurements) if m.experiment == experiment])
    own = [measurements[i] for i in rows]
    empty = defaults or {}
    levers = {
        name: np.array([m.levers.get(name, empty.get(name, np.nan)) for m in own], float)
        for name in dict.fromkeys([*(n for m in own for n in m.levers), *empty])
        if name in LEVERS
    }
    value = np.array([m.value for m in own])
    step = step_of(own)
    digits = (step or 0.0) / np.sqrt(12.0)
    replicated = np.hypot(stated_sd(own) / np.sqrt([m.n for m in own]),
                          [m.lever_error for m in own])  # fmt: skip
    error = np.maximum(replicated, FLOOR * digits)
    coarse = (error > replicated).any() or np.mean([m.sd <= digits for m in own]) >= COARSE
    log, slope = to_log(experiment, value, levers)
    labels = {name: np.array([getattr(m, name) for m in own]) for name in LABELS}
    # a row without a label shares nothing
    groups = {name: np.where(each == "", -1, np.unique(each, return_inverse=True)[1] - ("" in each))
              for name, each in labels.items() if len(set(each)) > 1}  # fmt: skip
    return Readings(
        experiment, rows, log, error * slope, replicated * slope, groups,
        np.array([m.n for m in own], float), value, slope * value, levers, _covariates(own),
        folds_of(levers), step, bool(step and coarse),
    )  # fmt: skip


STEPS = tuple(m * 10.0**k for k in range(2, -4, -1) for m in (5.0, 2.5, 2.0, 1.0))
LEAST_ROWS = 6  # readings for a step to be seen
FLOOR = 0.5
"""Least error of a reading, in standard deviations of what rounding takes off."""

COARSE = 0.25
"""Share of settings whose readings differ by no more than rounding takes off, for the step to be
coarser than their errors."""


def step_of(own: Sequence[Measurement]) -> float | None:
    """The largest of STEPS that all readings of `Measurement`s are multiples of, or None.

    A mean is one of n readings: n times it is a multiple, and half of the means are themselves."""
    each = [(v, 1 if m.readings else m.n) for m in own for v in (m.readings or (m.value,))]
    if len(each) < LEAST_ROWS:
        return None
    values, count = np.array(each, float).T

    def whole(value, step):
        return np.abs(value / step - np.round(value / step)) < 1e-6

    fit = (s for s in STEPS if whole(count * values, s).all() and whole(values, s).mean() >= 0.5)
    return next(fit, None)


def _covariates(own):
    """{name: (n,)} of the covariates that vary; a row without a value has their median."""
    out = {}
    for name in dict.fromkeys(n for m in own for n in m.covariates):
        value = np.array([m.covariates.get(name, np.nan) for m in own], float)
        value = np.where(np.isnan(value), np.nanmedian(value), value)
        if len(np.unique(value)) > 1:
            out[name] = value
    return out


def folds_of(levers: Mapping[str, np.ndarray]) -> dict[str, list[np.ndarray]]:
    """{lever: [indices (k,) of a level]} of the levers that vary."""
    codes = {name: level_of(value) for name, value in levers.items()}
    return {name: [np.flatnonzero(code == k) for k in range(code.max() + 1)]
            for name, code in codes.items() if code.max() > 0}  # fmt: skip


def level_of(value: np.ndarray) -> np.ndarray:
    """Numbers (n,) of the levels of a lever that is set to values (n,); not set is a level."""
    code: np.ndarray = np.unique(np.where(np.isnan(value), -1.0, value), return_inverse=True)[1]
    return code


def to_log(
    experiment: str, value: ArrayLike, levers: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Logarithm of a reading over its shape, and the derivative by the value. value and levers:
    (..., n), in their units; both results (..., n)."""
    value = np.asarray(value, float)
    if experiment == "tilt":
        angle = np.radians(value)
        return np.log(np.tan(angle)), np.radians(2.0 / np.sin(2.0 * angle))
    return np.log(value / levers.get(SHAPE.get(experiment, ""), 1.0)), 1.0 / value


def from_log(experiment: str, log: np.ndarray, levers: Mapping[str, np.ndarray]) -> np.ndarray:
    """The reading in its unit, of its logarithm over its shape. log and levers: (n,)."""
    if experiment == "tilt":
        return np.degrees(np.arctan(np.exp(log)))
    told: np.ndarray = np.exp(log) * levers.get(SHAPE.get(experiment, ""), 1.0)
    return told


def shared_covariance(
    measurements: Sequence[Measurement],
    values: np.ndarray,
    sds: Mapping[tuple[str, str], float],
) -> np.ndarray:
    """(n, n) covariance of what measurements share that are expected to read values (n,), of errors
    with the standard deviations sds {(experiment, column of the label): of the logarithm}. A row
    without a label shares nothing."""
    rows = list(zip(measurements, values, strict=True))
    by_log = 1.0 / np.array([to_log(m.experiment, v, dict(m.levers))[1] for m, v in rows])
    out = np.zeros((len(by_log), len(by_log)))
    for (kind, name), sd in sds.items():
        labels = [getattr(m, name) if m.experiment == kind else "" for m in measurements]
        same = np.array([[a == b != "" for b in labels] for a in labels])
        out += same * np.outer(sd * by_log, sd * by_log)
    return out
