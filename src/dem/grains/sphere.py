"""Volume and mass of a sphere, for floats and arrays alike."""

import math
from typing import Any


def volume(radius: Any) -> Any:
    """[m3] of spheres of `radius` [m]."""
    return 4.0 / 3.0 * math.pi * radius**3


def mass(radius: Any, density: float) -> Any:
    """[kg] of spheres of `radius` [m] and `density` [kg/m3]."""
    return volume(radius) * density
