"""The tests of a laboratory as a study simulates them: one list, whichever section of the
configuration describes them, and the run spec of each at the setting of a measured row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from calibration.intake.quantities import LEVERS
from calibration.study.config.specs import bench_run, machine_run, point_spec, with_levels
from calibration.study.matching import apart
from dem.spec import parse_spec

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement
    from calibration.study.config import Config


@dataclass(frozen=True)
class SimulatedTest:
    """A test as it is simulated.

    run : its run spec without levels and seed; own : the part of it that the test states itself;
    fixed : {factor: level} that it has whatever the study's is.
    """

    name: str
    experiment: str
    run: Mapping[str, Any]
    own: Mapping[str, Any]
    fixed: Mapping[str, float]


def tests_of(config: Config) -> list[SimulatedTest]:
    """The study's own test first, then those of the bench, the rigs and the machines."""
    found = [SimulatedTest(config.experiment, config.experiment, config.run, config.run, {})]
    for name in ("tilt", "drop", "shear"):
        section = getattr(config.bench, name)
        if section is not None:
            run, fixed = bench_run(config, section.run), getattr(section, "fixed", {})
            found.append(SimulatedTest(name, name, run, section.run, fixed))
    found += [rig_test(config, name) for name in config.rigs]
    return [*found, *machines_of(config)]


def rig_test(config: Config, name: str) -> SimulatedTest:
    """The test that a name in `rigs` stands for."""
    rig = config.rigs[name]
    return SimulatedTest(name, rig.experiment, machine_run(config, rig), rig.run, rig.fixed)


def machines_of(config: Config) -> list[SimulatedTest]:
    """The machines of `push_through`."""
    return [
        SimulatedTest(name, m.experiment, machine_run(config, m), m.run, {})
        for name, m in config.push_through.items()
    ]


def test_of(tests: Sequence[SimulatedTest], row: Measurement) -> SimulatedTest | None:
    """The test that simulates a measured row: the first of its experiment that is at its setting,
    else the first of its experiment; None where no test is of that experiment."""
    own = [t for t in tests if t.experiment == row.experiment]
    at = (t for t in own if apart(row, parse_spec(point_spec(t.run, t.experiment, {}, 1))) is None)
    return next(at, own[0] if own else None)


def at_setting(test: SimulatedTest, row: Measurement) -> SimulatedTest:
    """The test with the levers of a measured row."""
    places = {LEVERS[name].place: value for name, value in row.levers.items()}
    levels = {".".join(place): value for place, value in places.items() if place is not None}
    run = with_levels(test.run, levels)
    return SimulatedTest(test.name, test.experiment, run, test.own, test.fixed)
