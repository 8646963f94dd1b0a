"""The calibrated point as every export needs it: two materials and two kinds of contact in
effective constants."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dem.constants import GRAVITY
from dem.contact.export import Pair
from dem.contact.registry import Laws, Material, pair_properties
from dem.experiments.setup import time_step_of
from dem.grains import mean_radius
from dem.materials import PARTICLE, WALL, contact_parameters, material_of
from dem.spec import RunSpec

TYPICAL_LOAD = 10.0
"""Normal force of a typical contact in a heap, in grain weights: the pressure half-way down, rho g
h/2, on d^2 is h/(2d) = 10 weights for a heap that is twenty grains high. Only stiffnesses of
rolling springs that a code takes as constants depend on it."""


@dataclass(frozen=True)
class Granulate:
    """Grains and walls. `spec` is the run spec at the calibrated point."""

    spec: RunSpec
    grain: Material
    wall: Material
    radius: float
    grain_grain: Pair
    grain_wall: Pair

    @property
    def time_step(self) -> float:
        """Time step of the calibrated runs [s]."""
        return time_step_of(self.spec)


def granulate(spec: RunSpec) -> Granulate:
    """`Granulate` of a `RunSpec`. The mean grain stands for all where there is a size
    distribution."""
    grain, wall = material_of(spec.materials.particle), material_of(spec.materials.wall)
    radius = mean_radius(spec)
    inertia = 1.4 * 4 / 3 * math.pi * radius**5 * grain.density
    load = TYPICAL_LOAD * 4 / 3 * math.pi * radius**3 * grain.density * GRAVITY
    pairs = []
    contacts = contact_parameters(spec)
    for other, name, r_eff, i_eff in (
        (grain, PARTICLE, radius / 2, inertia / 2),
        (wall, WALL, radius, inertia),
    ):
        contact = contacts[PARTICLE, name]
        p = pair_properties(Laws(), grain, other, contact)
        pairs.append(Pair(p.young, p.shear, p.damping, r_eff, i_eff, load, name == WALL, contact))
    return Granulate(spec, grain, wall, radius, *pairs)
