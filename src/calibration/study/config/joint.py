"""The laboratory of a joint study: its rigs, the measured values of its targets, and what is wrong
with either."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from calibration.errors import CalibrationError, ConfigError
from calibration.intake.curves import SHAPES, read_curves
from calibration.intake.measurements import read_measured
from calibration.intake.quantities import quantity_name
from calibration.study.config.schema import METRICS
from calibration.study.config.specs import SEEDS_A_STAGE, machine_run, point_spec
from calibration.study.factors import Choice, refuse_choices
from calibration.study.matching import agreeing
from dem.errors import SpecError
from dem.spec import parse_spec

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement
    from calibration.study.config.schema import Config, JointTarget
    from calibration.study.factors import Factor
    from dem.spec import RunSpec


APART = 4.0
"""Standard errors of their difference from which on two rows of one test contradict each other."""


@dataclass(frozen=True)
class MeasuredMean:
    """What was measured of a target: rigs and metrics (q names each), mean (q,), covariance (q, q)
    of the mean, the degrees of freedom behind it, infinite where it is stated, and the standard
    deviation (q,) of one reading."""

    rigs: tuple
    metrics: tuple
    mean: np.ndarray
    covariance: np.ndarray
    freedom: float
    reading_sd: np.ndarray

    @property
    def of_rigs(self) -> dict[str, list[str]]:
        """{rig: its metrics}."""
        found: dict[str, list[str]] = {}
        for rig, metric in zip(self.rigs, self.metrics, strict=True):
            found.setdefault(rig, []).append(metric)
        return found


def name_of(target: JointTarget) -> str:
    """A target's name in tables and sentences: rig and metric or shape."""
    return f"{', '.join(target.rigs)}: {target.metric or target.shape}"


def rig_spec(config: Config, name: str) -> RunSpec:
    """`RunSpec` of a rig at the study's own levels. Raises SpecError."""
    rig = config.rigs[name]
    return parse_spec(point_spec(machine_run(config, rig), rig.experiment, {}, 1))


def handed_out_by(config: Config) -> str:
    """What the parameters that a study hands out come from, `chain` or `joint`."""
    return config.calibrate.by or ("joint" if _waits_for_all(config) else "chain")


def _waits_for_all(config):
    return config.targets and "joint" in config.supplements


def stated_error(config: Config, row: Measurement) -> float | None:
    """Standard error that a target states for a measured row of its experiment and metric, None
    where none does."""
    for target in config.targets:
        own = target.metric and quantity_name(target.metric) == row.quantity
        if own and config.rigs[target.rigs[0]].experiment == row.experiment:
            return target.error
    return None


def joint_factors(config: Config, factors: Iterable[Factor | Choice]) -> list[Factor | Choice]:
    """Factors of the table that are free in the joint study, in its order."""
    chosen = config.joint.factors
    return [f for f in factors if (f.name in chosen if chosen else not isinstance(f, Choice))]


def read_joint_target(config: Config, target: JointTarget) -> MeasuredMean:
    """`MeasuredMean` of a target. Raises ConfigError naming file, line and what is missing."""
    if target.curve:
        return _read_curve(config, target)
    table = read_measured(config.measurements)
    (rig,) = target.rigs  # of a metric, one
    experiment = config.rigs[rig].experiment
    quantity = quantity_name(target.metric)  # type: ignore[arg-type]  # in place of a curve
    found = agreeing(table, experiment, quantity, rig_spec(config, rig))
    rows = [_mean_of(m, target, table.path) for m in found]
    _refuse_contradicting(rows, found, table.path)
    return _pooled(target, rows, max(m.sd or 0.0 for m in found))


def _read_curve(config, target):
    key = SHAPES[target.shape].setting
    found = read_curves(target.curve, target.shape, _settings(config, target) if key else ())
    curves = found.freedom + len(found.metrics)
    sd = np.sqrt(np.diag(found.covariance) * curves)
    rigs = target.rigs if key else target.rigs * len(found.metrics)
    return MeasuredMean(rigs, found.metrics, found.mean, found.covariance, found.freedom, sd)


def _settings(config, target):
    """What a curve runs over, in each of the target's rigs."""
    key = SHAPES[target.shape].setting
    return tuple(getattr(rig_spec(config, name).geometry, key) for name in target.rigs)


def _mean_of(row, target, path):
    """(mean, variance of the mean, degrees of freedom) of a row or of the readings of one
    condition."""
    if target.error is not None and (row.sd is None or row.n < 2):
        return row.value, target.error**2, np.inf
    if row.sd is None:
        raise ConfigError(
            "has no error",
            path=path,
            line=row.line,
            column="sd",
            value=row.value,
            allowed="a second reading, sd and n in the row, or `error` beside the target",
        )
    # a stated deviation of one reading is an instrument's; of several it is estimated from them
    freedom = row.n - 1.0 if row.n >= 2 else np.inf
    return row.value, row.sd**2 / row.n, freedom


def _refuse_contradicting(rows, found, path):
    """Raise ConfigError for two rows of one test further apart than their errors allow."""
    for (a, first), (b, second) in combinations(zip(rows, found, strict=True), 2):
        error = np.sqrt(a[1] + b[1])
        if abs(a[0] - b[0]) > APART * error:
            raise ConfigError(
                f"contradicts line {first.line}: {first.value:g} there, ± {error:.2g} on their "
                "difference",
                path=path,
                line=second.line,
                column="value",
                value=second.value,
                allowed="one of them, or levers that tell them apart",
            )


def _pooled(target, rows, reading_sd):
    """Mean of rows weighted by their errors, which count as their own."""
    mean, variance, freedom = np.array(rows, float).T
    weight = 1.0 / variance
    pooled = weight @ mean / weight.sum()
    share = weight / weight.sum()
    whole = 1.0 / weight.sum()
    # Welch and Satterthwaite
    doubt = np.sum((share**2 * variance) ** 2 / freedom)
    behind = whole**2 / doubt if doubt > 0.0 else np.inf
    return MeasuredMean(
        target.rigs, (target.metric,), np.array([pooled]), np.array([[whole]]), float(behind),
        np.array([reading_sd or np.sqrt(whole)]),
    )  # fmt: skip


def check_joint(config: Config, factors: Sequence[Factor | Choice], file: str) -> None:
    """Raise ConfigError for what a joint study cannot be made of."""
    for name, rig in config.rigs.items():
        try:
            rig_spec(config, name)
        except (SpecError, CalibrationError) as error:
            raise ConfigError(str(error), path=file, key=f"rigs.{name}.run") from None
        _check_metrics(rig, f"rigs.{name}.metrics", file)
    seen = []
    for n, target in enumerate(config.targets):
        _check_target(config, target, f"targets.{n}", file)
        if name_of(target) in seen:
            value = name_of(target)
            raise ConfigError("stands twice", path=file, key=f"targets.{n}", value=value)
        seen.append(name_of(target))
        read_joint_target(config, target)
    _check_names(config, factors, file)
    if config.calibrate.by == "joint" and not _waits_for_all(config):
        allowed = "chain, or `targets` and joint among the supplements"
        key = "calibrate.by"
        raise ConfigError("has no stage", path=file, key=key, value="joint", allowed=allowed)


def _check_metrics(rig, key, file):
    for metric in rig.metrics:
        if metric not in METRICS[rig.experiment]:
            raise ConfigError(
                "is no metric of it", path=file, key=key, value=metric,
                allowed=f"for the experiment {rig.experiment}: "
                + ", ".join(METRICS[rig.experiment]),
            )  # fmt: skip


def _check_target(config, target, key, file):
    for name in target.rigs:
        if name not in config.rigs:
            allowed = ", ".join(config.rigs) or "a name in rigs, which has none"
            raise ConfigError("is no rig", path=file, key=f"{key}.rig", value=name, allowed=allowed)
    if bool(target.metric) == bool(target.curve) or bool(target.curve) != bool(target.shape):
        allowed = "either metric, or curve and shape"
        raise ConfigError("is not complete", path=file, key=key, allowed=allowed)
    experiment = config.rigs[target.rigs[0]].experiment
    _check_settings(config, target, key, file)
    if target.metric and target.metric not in METRICS[experiment]:
        raise ConfigError(
            "is no metric of it",
            path=file,
            key=f"{key}.metric",
            value=target.metric,
            allowed=f"for the experiment {experiment}: " + ", ".join(METRICS[experiment]),
        )
    if target.shape:
        known = [n for n, s in SHAPES.items() if set(s.metrics) <= set(METRICS[experiment])]
        if target.shape not in known:
            allowed = f"for the experiment {experiment}: " + (", ".join(known) or "no shape")
            key = f"{key}.shape"
            raise ConfigError(
                "is no shape of it", path=file, key=key, value=target.shape, allowed=allowed
            )


def _check_settings(config, target, key, file):
    """A curve over a setting has several rigs, which differ in it; every other target has one."""
    over = SHAPES[target.shape].setting if target.shape in SHAPES else None
    kinds = {config.rigs[name].experiment for name in target.rigs}
    if not over and len(target.rigs) == 1 and isinstance(target.rig, str):
        return
    allowed = f"rigs of one experiment that differ in geometry.{over}" if over else "one rig"
    if over and len(kinds) == 1 and hasattr(rig_spec(config, target.rigs[0]).geometry, over):
        if len(set(_settings(config, target))) == len(target.rigs) > 1:
            return
    value = ", ".join(target.rigs)
    raise ConfigError("does not go", path=file, key=f"{key}.rig", value=value, allowed=allowed)


def _check_names(config, factors, file):
    """Names in `joint` are of factors and rigs; a prior lies in its factor's levels."""
    names, joint = [f.name for f in factors], config.joint
    free = [f.name for f in joint_factors(config, factors)]
    for key, given, known in (
        ("joint.factors", joint.factors, names),
        ("joint.priors", joint.priors, free),
        ("joint.hours", joint.hours, list(config.rigs)),
        *((f"rigs.{rig}.fixed", own.fixed, names) for rig, own in config.rigs.items()),
        ("joint.machine", [joint.machine] if joint.machine else [], list(config.rigs)),
    ):
        for name in given:
            if name not in known:
                allowed = ", ".join(known)
                raise ConfigError("is not known", path=file, key=key, value=name, allowed=allowed)
    refuse_choices([f for f in factors if f.name in joint.factors], "the stage joint")
    for factor in (f for f in factors if f.name in joint.priors):
        mean = joint.priors[factor.name].mean
        if not factor.low <= mean <= factor.high:
            key = f"joint.priors.{factor.name}.mean"
            raise ConfigError(
                "lies outside its levels", path=file, key=key, value=mean, allowed=factor.levels
            )
    planned = joint.runs + joint.repeated + joint.second_wave
    if planned > SEEDS_A_STAGE:
        raise ConfigError(
            "asks for more runs of a rig than there are seeds", path=file, key="joint.runs",
            value=joint.runs, allowed=f"runs, repeated and second_wave of {SEEDS_A_STAGE} at most",
        )  # fmt: skip
    if joint.repeated > joint.runs:
        raise ConfigError(
            "is more than the points", path=file, key="joint.repeated", value=joint.repeated,
            allowed=f"at most {joint.runs} (runs)",
        )  # fmt: skip
