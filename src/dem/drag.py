"""Drag of still air on single spheres.

F = -3 pi mu d v (1 + 0.15 Re^0.687), Re = rho v d / mu: Schiller and Naumann (1933), Zeitschrift des VDI 77:318; for
Re < 800.
"""

import math

from numba import njit


@njit(cache=True, error_model="numpy")
def apply_drag(n, particles, density, viscosity):
    """Add the drag on each particle; density [kg/m3], viscosity [Pa s]."""
    for i in range(n):
        k = particles.kinetic[i]
        diameter = 2.0 * k[6]
        speed = math.sqrt(k[0] * k[0] + k[1] * k[1] + k[2] * k[2])
        reynolds = density * speed * diameter / viscosity
        factor = 3.0 * math.pi * viscosity * diameter * (1.0 + 0.15 * reynolds**0.687)
        for f in range(3):
            particles.force[i, f] -= factor * k[f]
