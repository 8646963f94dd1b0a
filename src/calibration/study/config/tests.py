"""What is wrong with the tests of a configuration, and with the names of tests elsewhere in it."""

import re
from collections.abc import Sequence

from calibration.errors import ConfigError, at_key
from calibration.study.config.schema import METRICS, Config, SweepConfig
from calibration.study.config.specs import point_spec, states
from calibration.study.factors import Factor
from dem.errors import SpecError
from dem.spec import RunSpec, parse_spec

SHEAR = "shear"
SWEPT = {
    "tilt": "contacts.particle_wall.static_friction",
    "drop": "contacts.particle_wall.restitution",
    SHEAR: "contacts.particle_particle.static_friction",
}
"""Experiment of a test that sweeps a factor -> that factor's key."""

LEAST_LOADS = 3


def spec_of(config: Config, name: str) -> RunSpec:
    """`RunSpec` of a test at the study's own levels. Raises SpecError."""
    return parse_spec(point_spec(config.run_of(name), config.tests[name].experiment, {}, 1))


def swept_test(config: Config, experiment: str) -> str:
    """Name of the test of an experiment that has a sweep. Raises ConfigError without one."""
    name = config.of_experiment(experiment)
    if name and config.tests[name].sweep:
        return name
    raise ConfigError(
        f"must be given for the stage {experiment}", key="tests",
        allowed=f"a test with experiment: {experiment} and sweep: {{ levels: ... }}",
    )  # fmt: skip


def is_swept(config: Config, factors: Sequence[Factor], experiment: str) -> bool:
    """Return whether a test of an experiment sweeps a factor of the study."""
    name = config.of_experiment(experiment)
    keys = [f.key for f in factors]
    return bool(name and config.tests[name].sweep and SWEPT[experiment] in keys)


def sweep_of(config: Config, experiment: str) -> SweepConfig:
    """The sweep of that test. Raises ConfigError."""
    sweep = config.tests[swept_test(config, experiment)].sweep
    assert sweep is not None
    return sweep


def predicted(config: Config) -> list[str]:
    """Names of the tests that are run with draws of a posterior. Raises ConfigError for none."""
    found = config.predict.tests or [name for name in config.tests if name != config.own]
    if not found:
        allowed = f"a test beside {config.own}"
        raise ConfigError("must be given for the stage push_through", key="tests", allowed=allowed)
    return found


def key_in(config: Config, name: str, key: str) -> str:
    """The dotted key of the configuration that sets a key of a test's run spec, the test's own
    where none does."""
    shared = states(config.run, key) and not states(config.tests[name].run, key)
    return f"run.{key}" if shared else f"tests.{name}.run.{key}"


def check_tests(config: Config) -> None:
    """Raise ConfigError for tests that cannot be simulated as they are described, and for names
    that are none of them."""
    for name, test in config.tests.items():
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
            allowed = "letters, digits, _ and -, a letter first"
            raise at_key(f"tests.{name}", "is no name", allowed=allowed)
        _check_metrics(f"tests.{name}.metrics", test.experiment, test.metrics)
        _check_sweep(test, f"tests.{name}.sweep")
        _check_metrics(f"tests.{name}.discrepancy", test.experiment, test.discrepancy)
    for key, names in (
        ("calibrate.test", [config.own]),
        ("predict.tests", config.predict.tests),
        ("joint.tests", config.joint.tests),
        ("posterior.hours", config.posterior.hours),
        ("joint.machine", [config.joint.machine] if config.joint.machine else []),
    ):
        for name in names:
            if name not in config.tests:
                raise at_key(key, "is no test", name, ", ".join(config.tests))
    _check_metrics("calibrate.to", config.experiment, [config.target])
    _check_bench(config)
    _check_runs(config)


def _check_metrics(key, experiment, metrics):
    for metric in metrics:
        if metric not in METRICS[experiment]:
            allowed = f"for the experiment {experiment}: " + ", ".join(METRICS[experiment])
            raise at_key(key, f"has {metric}, which is no metric of it", allowed=allowed)


def _check_sweep(test, key):
    """A shear test is swept under three loads or more, tilted plane and drop under none."""
    if test.sweep is None:
        return
    if test.experiment not in SWEPT:
        raise at_key(key, f"does not go with {test.experiment}", allowed=", ".join(SWEPT))
    least = 3 if test.experiment == SHEAR else 4
    if len(test.sweep.levels) < least:
        allowed = f"{least} levels or more"
        raise at_key(f"{key}.levels", "are too few", test.sweep.levels, allowed)
    loads = test.sweep.normal_stresses_kPa
    if (len(loads) < LEAST_LOADS) if test.experiment == SHEAR else loads:
        allowed = f"{LEAST_LOADS} loads or more of a shear test, none of another"
        raise at_key(f"{key}.normal_stresses_kPa", "does not go", loads, allowed)


def _check_bench(config):
    """One sweep of an experiment, and all of them where their levels are taken."""
    if config.tests[config.own].fixed:
        key = f"tests.{config.own}.fixed"
        allowed = "none: the study's own `fixed` holds for the test that it is calibrated on"
        raise at_key(key, "does not go", allowed=allowed)
    for kind in SWEPT:
        own = [n for n, t in config.tests.items() if t.experiment == kind and t.sweep]
        if len(own) > 1:
            allowed = f"one sweep of {kind}, not {', '.join(own)}"
            raise at_key(f"tests.{own[1]}.sweep", "is one too many", allowed=allowed)
        if not own and config.fixed_from == "bench":
            why = f"must be given where fixed_from is bench: a test of {kind} with a sweep"
            raise at_key("tests", why)


def _check_runs(config):
    for name in (n for n in config.tests if n != config.own):  # that one is tried with its factors
        try:
            spec_of(config, name)
        except SpecError as error:
            key = key_in(config, name, error.key) if error.key else f"tests.{name}.run"
            raise at_key(key, "is not valid", error.value, error.allowed) from None
