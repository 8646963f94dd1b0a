"""Linear spring: F = k overlap, whatever the size of the spheres; with `linear` damping the linear
spring-dashpot.

Cundall, Strack (1979), Geotechnique 29:47. An impact lasts pi/sqrt(k/m* (1 - beta^2)) at any speed.
"""

import math

from dem.contact.law import Law, Parameter
from dem.kernel.arithmetic import law, maximum, sqrt

STIFFNESS = Parameter(
    key="normal_stiffness_N_m",
    name="normal_stiffness",
    meaning="stiffness of the normal spring while it loads, grain on grain and on wall",
    limits={"gt": 0},
)

BESIDE = {"tangential": ("linear",), "torsion": ("none",), "cohesion": ("none", "liquid_bridge")}
"""Slot -> laws that go with a linear spring."""


def step_of(stiffness: float, mass: float) -> float:
    """Longest time step [s]: a contact of two grains, pi sqrt(m/2k), then takes eleven."""
    return 0.2 * math.sqrt(mass / stiffness)


@law
def normal(p, overlap, r_eff, deepest):
    """Elastic force, stiffness, contact radius, deepest overlap (not its business) and no
    adhesion."""
    pressed = maximum(overlap, 0.0)
    stiffness = p.normal_stiffness + 0.0 * r_eff
    return stiffness * pressed, stiffness, sqrt(r_eff * pressed), deepest, 0.0 * r_eff


LAW = Law(
    slot="normal",
    name="linear",
    equation="F = k δ, S_n = k",
    source="Cundall, Strack (1979)",
    kernels={"normal": normal},
    parameters=(STIFFNESS,),
    constants=("normal_stiffness",),
    only_with={"damping": ("linear",)} | BESIDE,
    longest_step=lambda contact, mass, rayleigh: step_of(contact.normal_stiffness, mass),
    left_out="NOT CONVERTED: normal linear; the exported spring is that of Hertz.",
)
