"""The calibrated point as every export needs it: two materials and two kinds of contact in
effective constants."""

import math
from dataclasses import dataclass

from dem.constants import GRAVITY
from dem.contact.registry import Laws, Material, pair_properties
from dem.experiments.setup import time_step_of
from dem.grains import mean_radius
from dem.materials import contact_parameters, material_of
from dem.spec import RunSpec

TYPICAL_LOAD = 10.0
"""Normal force of a typical contact in a heap, in grain weights: the pressure half-way down, rho g
h/2, on d^2 is h/(2d) = 10 weights for a heap that is twenty grains high. Only stiffnesses of
rolling springs that a code takes as constants depend on it."""


@dataclass(frozen=True)
class Pair:
    """Constants of one kind of contact. young, shear: effective moduli E*, G* [Pa]; radius:
    effective radius R* [m]; inertia: I1 I2/(I1 + I2) about the contact point [kg m2]; dashpot:
    factor of sqrt(stiffness m*) in the damping force [-]."""

    young: float
    shear: float
    restitution: float
    static_friction: float
    rolling_friction: float
    dashpot: float
    radius: float
    inertia: float

    def contact_radius(self, load):
        """Radius a [m] of a Hertz contact under `load` [N]: a^3 = 3 F R*/(4 E*) (Johnson 1985,
        4.22)."""
        return (0.75 * load * self.radius / self.young) ** (1 / 3)


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
    def mass(self):
        """Mass of the mean grain [kg]."""
        return 4 / 3 * math.pi * self.radius**3 * self.grain.density

    @property
    def load(self):
        """Normal force [N] of a typical contact."""
        return TYPICAL_LOAD * self.mass * GRAVITY

    @property
    def time_step(self):
        """Time step of the calibrated runs [s]."""
        return time_step_of(self.spec)


def granulate(spec):
    """`Granulate` of a `RunSpec`. The mean grain stands for all where there is a size
    distribution."""
    grain, wall = material_of(spec.materials.particle), material_of(spec.materials.wall)
    radius = mean_radius(spec)
    inertia = 1.4 * 4 / 3 * math.pi * radius**5 * grain.density
    pairs = []
    for other, contact, r_eff, i_eff in (
        (grain, contact_parameters(spec)["particle", "particle"], radius / 2, inertia / 2),
        (wall, contact_parameters(spec)["particle", "wall"], radius, inertia),
    ):
        p = pair_properties(Laws(), grain, other, contact)
        pairs.append(
            Pair(
                p.young,
                p.shear,
                contact.restitution,
                contact.static_friction,
                contact.rolling_friction,
                p.damping,
                r_eff,
                i_eff,
            )
        )
    return Granulate(spec, grain, wall, radius, *pairs)


def rolling_stiffness(pair, rolling_friction, load, factor):
    """Rotational stiffness k_r [N m] of the elastic-plastic law at a load [N]: factor S_n (mu_r
    R*)^2, S_n = 2 E* a.

    Ai, Chen, Rotter, Ooi (2011), Powder Technology 206:269, model C; factor as in
    `dem.contact.rolling`.
    """
    normal = 2.0 * pair.young * pair.contact_radius(load)
    return factor * normal * (rolling_friction * pair.radius) ** 2


def rolling_dashpot(pair, stiffness, ratio):
    """Coefficient of the rolling dashpot [N m s] for a damping ratio: 2 ratio sqrt(I k_r)."""
    return 2.0 * ratio * math.sqrt(pair.inertia * stiffness)
