"""A grain made of two equal spheres that overlap or touch: its size, mass and moments of inertia.

Spheres of radius a with centres 2 h apart; the elongation is length over width, (2 a + 2 h) / 2 a =
1 + h / a, from 1 (one sphere) to 2 (two that touch). The overlap counts once: each half of the body
is a sphere cut at the plane between the two. Let t be the distance from its centre along the axis,
from -h to a. Volume and moments are integrals of its slices, discs of squared radius a^2 - t^2.
"""

import math
from typing import Any

MAX_ELONGATION = 2.0


def sphere_radius(radius: Any, elongation: float) -> Any:
    """Radius a [m] of the two spheres of a grain with the volume of one sphere of `radius` [m].

    V = (4/3) pi a^3 (1 + 3/2 e - 1/2 e^3), e = elongation - 1 = h / a.
    """
    e = elongation - 1.0
    return radius / (1.0 + 1.5 * e - 0.5 * e**3) ** (1.0 / 3.0)


def moments(radius: Any, elongation: float, density: float) -> tuple[Any, Any]:
    """Moments of inertia (about the axis, across it) [kg m2] of spheres of `radius` a [m] and
    `density` [kg/m3].

    About the axis: pi rho integral of (a^2 - t^2)^2 dt. Across: half of that and 2 pi rho integral
    of (t + h)^2 (a^2 - t^2) dt.
    """
    e, scale = elongation - 1.0, math.pi * density * radius**5
    about = 8.0 / 15.0 + e - 2.0 / 3.0 * e**3 + e**5 / 5.0
    offset = 2.0 / 15.0 + e / 2.0 + 2.0 / 3.0 * e**2 + e**3 / 3.0 - e**5 / 30.0
    return scale * about, scale * (0.5 * about + 2.0 * offset)
