"""The tests of a laboratory as a study simulates them, and the run spec of each at the setting of
a measured row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from calibration.intake.quantities import LEVERS, measurable
from calibration.study.config.specs import point_spec, with_levels
from calibration.study.matching import apart
from dem.spec import parse_spec

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement
    from calibration.study.config import Config


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
