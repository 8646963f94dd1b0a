"""The laboratory of a joint study: its tests, the measured values of its targets, and what is wrong
with either."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import ConfigError, at_key
from calibration.intake.measurements import read_measured
from calibration.study.config.measured import NotComparableError, is_measured, pooled, rows_of
from calibration.study.config.schema import METRICS, Config
from calibration.study.factors import Factor
from dem.units import without_unit


@dataclass(frozen=True)
class JointTarget:
    """A measured metric of a test. discrepancy: standard deviation by which the model itself may be
    wrong, in the metric's unit."""

    test: str
    metric: str
    discrepancy: float

    @property
    def name(self) -> str:
        """Its name in tables and sentences."""
        return f"{self.test}: {self.metric}"


@dataclass(frozen=True)
class MeasuredMean:
    """What was measured of a target: mean, variance of the mean, the degrees of freedom behind it,
    infinite where it is stated, and the standard deviation of one reading."""

    mean: float
    variance: float
    freedom: float
    reading_sd: float


def joint_tests(config: Config) -> list[str]:
    """Names of the tests that the joint study runs."""
    return config.joint.tests or list(config.tests)


def joint_targets(config: Config) -> list[JointTarget]:
    """Return what was measured of the tests of the joint study: the metrics of which the table has
    a row at their setting. Raises ConfigError for a table that cannot be read, and for a quantity
    that was measured at settings of no test alone."""
    table, found = read_measured(config.measurements), []
    at_none: dict[tuple[str, str], ConfigError | None] = {}
    taken: set[tuple[int | None, str]] = set()
    for name in joint_tests(config):
        test = config.tests[name]
        for metric in test.metrics or METRICS[test.experiment]:
            if not table.of(test.experiment, without_unit(metric)):
                continue
            try:
                rows = {(row.line, metric) for row in rows_of(config, table, name, metric)}
            except NotComparableError as error:
                at_none.setdefault((test.experiment, metric), error)
                continue
            at_none[test.experiment, metric] = None
            if rows & taken:  # each reading counts once, in the first test at its setting
                continue
            taken |= rows
            doubt = test.discrepancy.get(metric, 0.0)
            found.append(JointTarget(name, metric, doubt))
    if fault := next(filter(None, at_none.values()), None):
        raise fault
    return found


def own_targets(config: Config) -> list[JointTarget]:
    """Return the target of the one test that the chain calibrates on, where it was measured. Raises
    ConfigError for a table that cannot be read."""
    doubt = config.tests[config.own].discrepancy.get(config.target, 0.0)
    return [JointTarget(config.own, config.target, doubt)] if is_measured(config) else []


def measured_of(config: Config, targets: Iterable[JointTarget]) -> dict[JointTarget, MeasuredMean]:
    """{target: `MeasuredMean`}. Raises ConfigError naming file, line and what is missing."""
    return {target: read_joint_target(config, target) for target in targets}


def refined_tests(config: Config) -> list[str]:
    """Names of the tests that get runs where the first posterior is wide: those of the targets, and
    the one that is to be predicted. Raises ConfigError."""
    names = [*(t.test for t in joint_targets(config)), config.joint.machine]
    return list(dict.fromkeys(name for name in names if name))


def handed_out_by(config: Config) -> str:
    """The stages that the parameters come from which a study hands out, `chain` or `joint`."""
    if config.by_atlas:
        return "joint"
    return config.calibrate.by or ("joint" if "joint" in config.supplements else "chain")


def joint_factors(config: Config, factors: Iterable[Factor]) -> list[Factor]:
    """Factors of the table that are free in the joint study, in its order."""
    chosen = config.joint.factors
    return [f for f in factors if not chosen or f.name in chosen]


def read_joint_target(config: Config, target: JointTarget) -> MeasuredMean:
    """`MeasuredMean` of a target. Raises ConfigError naming file, line and what is missing."""
    table = read_measured(config.measurements)
    found = rows_of(config, table, target.test, target.metric)
    mean = pooled(found)
    if np.isnan(mean.sd):
        raise ConfigError(
            "has no error", path=table.path, line=found[0].line, column="sd", value=mean.value,
            allowed="a second reading, or sd in the row: the standard deviation of one reading",
        )  # fmt: skip
    # a stated deviation of single readings is an instrument's; of several it is estimated from them
    stated = mean.of == "values" and all(m.n == 1 for m in found)
    freedom = np.inf if stated else mean.n - 1.0
    return MeasuredMean(mean.value, mean.sd**2 / mean.n, freedom, mean.sd)


def check_joint(config: Config, factors: Sequence[Factor]) -> None:
    """Raise ConfigError for what a joint study cannot be made of."""
    _check_numbers(config, factors)
    if "joint" in config.supplements:
        check_targets(config)
    elif handed_out_by(config) == "joint":
        allowed = "chain, or joint among the supplements"
        raise at_key("calibrate.by", "has no stage", config.calibrate.by, allowed)


def check_targets(config: Config) -> None:
    """Raise ConfigError where no test of the joint study was measured, or what was measured of one
    cannot be used."""
    if not measured_of(config, joint_targets(config)):
        raise ConfigError(
            "has no row of a test of the joint study", path=config.measurements,
            allowed=f"a reading at the setting of {', '.join(joint_tests(config))}",
        )  # fmt: skip


def _check_numbers(config, factors):
    """A prior lies in its factor's levels, and no more points are repeated than there are."""
    joint, priors = config.joint, config.posterior.priors
    for factor in (f for f in factors if f.name in priors):
        mean = priors[factor.name].mean
        if not factor.low <= mean <= factor.high:
            key = f"posterior.priors.{factor.name}.mean"
            raise at_key(key, "lies outside its levels", mean, factor.levels)
    if joint.repeated > joint.runs:
        allowed = f"at most {joint.runs} (runs)"
        raise at_key("joint.repeated", "is more than the points", joint.repeated, allowed)
