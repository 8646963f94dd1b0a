"""Mass of a sphere, for floats and arrays alike."""

import math
from typing import Any


def mass(radius: Any, density: float) -> Any:
    """[kg] of spheres of `radius` [m] and `density` [kg/m3]."""
    return 4.0 / 3.0 * math.pi * radius**3 * density
