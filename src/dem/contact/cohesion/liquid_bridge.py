"""Capillary bridge between wet spheres; forms on touch, breaks at the rupture distance.

F = 2 pi R G cos(theta) / (1 + 1.05 s sqrt(R/V) + 2.5 s^2 R/V),  s the gap, V the volume of the
bridge, R the harmonic mean radius 2 R*, on a flat wall twice the sphere's: Willett, Adams, Johnson,
Seville (2000), Langmuir 16:9396. Rupture at (1 + theta/2) V^(1/3): Lian, Thornton, Adams (1993),
Journal of Colloid and Interface Science 161:138. The volume is a share of the grain's, V = liquid *
(4/3) pi r^3, r the radius of the sphere on a wall and the harmonic mean radius of two spheres.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dem.contact.law import Law, Parameter
from dem.kernel.arithmetic import law, maximum, sqrt

if TYPE_CHECKING:
    from dem.contact.registry import ContactParameters


def reach(liquid: float, contact_angle: float) -> float:
    """Rupture distance over the radius of the grain [-]; contact_angle [rad]."""
    return (1.0 + contact_angle / 2.0) * (4.0 / 3.0 * math.pi * liquid) ** (1.0 / 3.0)


@law
def attraction(p, overlap, r_eff, grain):
    """Attractive force [N] at an effective radius R* and a grain's radius r [m]; the gap is zero
    while they touch."""
    radius = 2.0 * r_eff
    volume = 4.0 / 3.0 * math.pi * p.liquid * grain * grain * grain
    gap = maximum(-overlap, 0.0) * sqrt(radius / volume)
    return 2.0 * math.pi * radius * p.cohesion * p.wetting / (1.0 + 1.05 * gap + 2.5 * gap * gap)


@law
def span(p, r_eff, grain):
    """Gap [m] at which the bridge breaks."""
    return grain * p.bridge_reach


def values(contact: ContactParameters) -> dict[str, float]:
    """Constants of `ContactParameters`; a dry pair has a volume that divides nothing by zero, and
    no tension."""
    wet = contact.liquid_volume_fraction > 0.0
    volume = contact.liquid_volume_fraction if wet else 1.0
    return {
        "cohesion": contact.surface_tension if wet else 0.0,
        "wetting": math.cos(contact.contact_angle),
        "liquid": volume,
        "bridge_reach": reach(volume, contact.contact_angle) if wet else 0.0,
    }


LAW = Law(
    slot="cohesion",
    name="liquid_bridge",
    equation="2πRγ cos θ / (1 + 1.05 s√(R/V) + 2.5 s² R/V), R = 2R*, rupture at (1 + θ/2) V^(1/3)",
    source="Willett et al. (2000); Lian et al. (1993)",
    kernels={"attraction": attraction, "reach": span},
    parameters=(
        Parameter("surface_tension_N_m", "surface_tension", "surface tension", {"gt": 0}),
        Parameter(
            key="contact_angle_deg",
            name="contact_angle",
            meaning="contact angle",
            limits={"ge": 0, "lt": 90},
            default=0.0,
            to_si=lambda angle, grain: math.radians(angle),
        ),
        Parameter(
            key="liquid_volume_fraction",
            name="liquid_volume_fraction",
            meaning="bridge over grain volume",
            limits={"ge": 0, "le": 0.1},
            wall=True,
        ),
    ),
    constants=("cohesion", "wetting", "liquid", "bridge_reach"),
    values=values,
    left_out="NOT CONVERTED: cohesion liquid_bridge; these grains do not stick.",
)
