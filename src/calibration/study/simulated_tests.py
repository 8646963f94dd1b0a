"""The tests of a laboratory as a study simulates them, the run spec of each at the setting of a
measured row, and what of a level holds in rigs whose grains differ in size."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS, measurable
from calibration.study.config import Config
from calibration.study.config.measured import apart
from calibration.study.config.specs import point_spec, states, with_levels
from dem.grains.sizes import grain_volume
from dem.spec import parse_spec


@dataclass(frozen=True)
class SimulatedTest:
    """A test as it is simulated.

    run : its run spec without levels and seed; own : the part of it that the test states itself;
    fixed : {factor: level} that it has whatever the study's is; metrics: those that it is for, all
    where it names none.
    """

    name: str
    experiment: str
    run: Mapping[str, Any]
    own: Mapping[str, Any]
    fixed: Mapping[str, float]
    metrics: Sequence[str] = ()


def tests_of(config: Config) -> list[SimulatedTest]:
    """All tests, the one that the chain is calibrated on first."""
    return [simulated(config, name) for name in sorted(config.tests, key=config.own.__ne__)]


def simulated(config: Config, name: str) -> SimulatedTest:
    """The test of a name in `tests`."""
    test = config.tests[name]
    return SimulatedTest(
        name, test.experiment, config.run_of(name), test.run, test.fixed, test.metrics
    )


def test_of(tests: Sequence[SimulatedTest], row: Measurement) -> SimulatedTest | None:
    """The test that simulates a measured row: the one that it names, else the first of its
    experiment that is at its setting, else the first of its experiment; None where no test is of
    that experiment."""
    metric = measurable(row.experiment)[row.quantity].key
    own = [
        t for t in tests
        if t.experiment == row.experiment
        and row.test in ("", t.name) and (not t.metrics or metric in t.metrics)
    ]  # fmt: skip
    at = (t for t in own if apart(row, parse_spec(point_spec(t.run, t.experiment, {}, 1))) is None)
    return next(at, own[0] if own else None)


def at_setting(test: SimulatedTest, row: Measurement) -> SimulatedTest:
    """The test with the levers of a measured row."""
    places = {LEVERS[name].place: value for name, value in row.levers.items()}
    levels = {".".join(place): value for place, value in places.items() if place is not None}
    run = with_levels(test.run, levels)
    return replace(test, run=run)


LAW = "law_parameters"
WITH_SIZE = tuple(
    f"{LAW}.{key}"
    for key in (
        "surface_energy_J_m2", "wall_surface_energy_J_m2",
        "adhesion_energy_J_m2", "wall_adhesion_energy_J_m2", "surface_tension_N_m",
    )
)  # fmt: skip
"""Keys of a run whose force goes with a grain's size, and not with its square: pull-off of JKR and
of EEPA, and a liquid bridge's."""


def ratios(config: Config, test: SimulatedTest, keys: Iterable[str]) -> dict[str, float]:
    """{key: by what a level of the study is multiplied in a test} of those among `keys` of factors
    and of the study's run that go with the size of grains; none where the test's grains are as
    large as the study's. A level that the test states itself stays. Raises SpecError."""
    keys = set(keys)
    shared = {k for k in WITH_SIZE if states(config.own_run, k) and not states(test.own, k)}
    found = [k for k in WITH_SIZE if k in keys | shared]
    if not found:
        return {}
    whole = parse_spec(point_spec(config.own_run, config.experiment, {}, 1))
    spec = parse_spec(point_spec(test.run, test.experiment, {}, 1))
    ratio = (grain_volume(spec) / grain_volume(whole)) ** (1 / 3)
    return {} if abs(ratio - 1.0) < 1e-6 else dict.fromkeys(found, float(f"{ratio:.9g}"))


def sized(run: Mapping[str, Any], ratio: Mapping[str, float]) -> dict[str, Any]:
    """A run spec (a mapping) with its own levels of these keys multiplied."""
    law = {
        key.partition(".")[2]: run[LAW][key.partition(".")[2]] * by
        for key, by in ratio.items()
        if states(run, key)
    }
    return {**run, LAW: {**run[LAW], **law}} if law else dict(run)
