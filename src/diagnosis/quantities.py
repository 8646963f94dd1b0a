"""The quantities that are measured and the levers that are set, from what the experiments declare
of themselves."""

import numpy as np

from dem.experiments import experiments
from dem.experiments.declare import Lever, Plain

QUANTITIES = {name: e.quantity for name, e in experiments().items() if e.quantity}
"""Experiment -> what it measures."""

POURED = {name for name in QUANTITIES if experiments()[name].poured}
"""Experiments whose runs scatter from seed to seed, because grains never lie twice alike."""


class Logarithm(Plain):
    """A quantity that is positive and whose spread goes with its value."""

    def __init__(self, least):
        self.least = least

    def forward(self, value, levers):
        """Logarithm of the value; that of `least` [the quantity's unit] for what is below."""
        return np.log(np.maximum(value, self.least))

    def inverse(self, z, levers):
        """Value and its derivative."""
        value = np.exp(z)
        return value, value


def scale_of(experiment):
    """What an emulator learns of an experiment's quantity: its own scale where it declares one.

    Without one, the logarithm of what is known to a share of itself: an error of the emulator that
    is alike everywhere would else drown the small values."""
    quantity = QUANTITIES[experiment]
    if quantity.relative and type(quantity.scale) is Plain:
        return Logarithm(quantity.least)
    return quantity.scale


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
