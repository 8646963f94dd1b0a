"""The quantities that are measured and the levers that are set, from what the experiments declare
of themselves."""

from dem.experiments import experiments
from dem.experiments.declare import Lever

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


def levers_of(experiment):
    """{column: Lever} of an experiment."""
    return _EVERYWHERE | experiments()[experiment].levers


LEVERS = _EVERYWHERE | {c: x for name in QUANTITIES for c, x in levers_of(name).items()}
"""Lever column -> what it is."""


def having(lever):
    """Experiments that have a lever."""
    return tuple(name for name in QUANTITIES if lever in levers_of(name))
