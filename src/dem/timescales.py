"""Time scales that limit the time step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dem.grains import sphere

if TYPE_CHECKING:
    from dem.contact.registry import Material


def rayleigh_time(
    radius: float, density: float, shear_modulus: float, poisson_ratio: float
) -> float:
    """Time of a Rayleigh wave across a grain [s]: pi R sqrt(rho/G) / (0.1631 nu + 0.8766).

    radius [m], density [kg/m3], shear_modulus [Pa]. Li, Xu, Thornton (2005), Chemical Engineering
    Science 60:5793."""
    speed = math.sqrt(shear_modulus / density) * (0.1631 * poisson_ratio + 0.8766)
    return math.pi * radius / speed


def hertz_contact_time(radius: float, speed: float, grain: Material, wall: Material) -> float:
    """Duration of an elastic impact on a flat wall [s]: 2.868 (m^2 / (R E*^2 v))^(1/5).

    radius [m]; speed of impact [m/s]; grain, wall: `dem.contact.registry.Material`. Johnson (1985),
    Contact Mechanics, 11.24.
    """
    mass = sphere.mass(radius, grain.density)
    compliance = (1 - grain.poisson_ratio**2) / grain.young_modulus
    compliance += (1 - wall.poisson_ratio**2) / wall.young_modulus
    return 2.868 * (mass**2 * compliance**2 / (radius * speed)) ** 0.2
