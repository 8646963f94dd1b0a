"""What passes an opening: Beverloo's law, and where arches begin."""

import math

from dem.constants import GRAVITY

C_BEVERLOO, K_BEVERLOO = 0.58, 1.4
"""Beverloo, Leniger and van de Velde (1961), Chemical Engineering Science 15:260, smooth grains."""

FREE_FLOW_RATIO = 5.0
"""Opening over largest grain below which arches stop the flow at times (Zuriguel et al. 2005,
Physical Review E 71:051303)."""

LOOSE = 0.5  # solid fraction of grains that have just been poured, at the least


def beverloo(density: float, opening: float, diameter: float) -> float:
    """rho_b sqrt(g) (D - k d)^(5/2): mass per second [kg/s] through a circular opening, over C.

    density: of the bulk [kg/m3], or its solid fraction for a volume per second; opening D and mean
    grain d [m]. 0 where the opening is narrower than k d.
    """
    return density * math.sqrt(GRAVITY) * max(opening - K_BEVERLOO * diameter, 0.0) ** 2.5
