"""Capillary bridge between wet spheres; forms on touch, breaks at the rupture distance.

F = 2 pi R G cos(theta) / (1 + 1.05 s sqrt(R/V) + 2.5 s^2 R/V),  s the gap, V the volume of the bridge, R the
harmonic mean radius 2 R*, on a flat wall twice the sphere's: Willett, Adams, Johnson, Seville (2000), Langmuir 16:9396.
Rupture at (1 + theta/2) V^(1/3): Lian, Thornton, Adams (1993), Journal of Colloid and Interface Science 161:138.
The volume is a share of the grain's, V = liquid * (4/3) pi r^3, r the radius of the sphere on a wall and the harmonic
mean radius of two spheres.
"""

import math

from dem.lanes import law, maximum, sqrt


def reach(liquid, contact_angle):
    """Rupture distance over the radius of the grain [-]; contact_angle [rad]."""
    return (1.0 + contact_angle / 2.0) * (4.0 / 3.0 * math.pi * liquid) ** (1.0 / 3.0)


@law
def attraction(p, overlap, r_eff, grain):
    """Attractive force [N] at an effective radius R* and a grain's radius r [m]; the gap is zero while they touch."""
    radius = 2.0 * r_eff
    volume = 4.1887902047863905 * p.liquid * grain * grain * grain
    gap = maximum(-overlap, 0.0) * sqrt(radius / volume)
    return (
        6.283185307179586 * radius * p.cohesion * p.wetting / (1.0 + 1.05 * gap + 2.5 * gap * gap)
    )
