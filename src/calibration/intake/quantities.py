"""The quantities that are measured and the levers that are set, from what the experiments declare
of themselves."""

from functools import cache
from typing import NamedTuple

from dem.experiments import experiments
from dem.experiments.declare import Lever
from dem.units import unit_of, without_unit

QUANTITIES = {name: e.quantity for name, e in experiments().items() if e.quantity}
"""Experiment -> what it measures."""

POURED = {name for name in QUANTITIES if experiments()[name].poured}
"""Experiments whose runs scatter from seed to seed, because grains never lie twice alike."""

_EVERYWHERE = {
    "particle_diameter_mm": Lever(
        1e-3, 100.0, "grain diameter", "mm", ("particles", "diameter_mm")
    ),
    "scale_factor": Lever(0.01, 100.0, "scale factor", "", ("particles", "scale_factor")),
}


def levers_of(experiment: str) -> dict[str, Lever]:
    """{column: Lever} of an experiment."""
    return _EVERYWHERE | experiments()[experiment].levers


LEVERS = _EVERYWHERE | {c: x for name in QUANTITIES for c, x in levers_of(name).items()}
"""Lever column -> what it is."""


class Condition(NamedTuple):
    """What is measured or simulated: an experiment, and the levers that are set."""

    experiment: str
    levers: dict


class Measurable(NamedTuple):
    """A quantity that a table of measurements may hold: the metric of a run that it is compared
    with, its unit and its limits. below: a lever that it cannot exceed."""

    key: str
    unit: str
    least: float
    most: float
    below: str | None = None


@cache
def measurable(experiment: str) -> dict[str, Measurable]:
    """{name: Measurable} of the metrics of an experiment that something can be compared with."""
    own, found = QUANTITIES.get(experiment), {}
    for metric in experiments()[experiment].metrics:
        if not metric.target:
            continue
        name, unit = without_unit(metric.name), unit_of(metric.name) or ""
        limits = unit, metric.least, metric.most, None  # type: tuple[str, float, float, str | None]
        if own and own.name == name:
            limits = own.unit, own.least, own.most, own.below
        found[name] = Measurable(metric.name, *limits)
    return found
