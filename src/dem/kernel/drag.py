"""Drag of still air on single spheres.

F = -3 pi mu d v (1 + 0.15 Re^0.687), Re = rho v d / mu: Schiller and Naumann (1933), Zeitschrift
des VDI 77:318, up to Re of about 1000; above, Newton's drag with C_D = 0.44, until the boundary
layer turns turbulent near Re = 2e5 (Clift, Grace, Weber 1978, Bubbles, Drops, and Particles,
chapter 5).
"""

import math

from numba import njit

from dem.kernel.simd import inlined

NEWTON = 0.44 / 24.0  # C_D Re / 24 over Re where the drag grows as the square of the speed


@inlined
def resistance(density, viscosity, diameter, speed):
    """Drag over speed [N s/m] of a sphere of `diameter` [m] at `speed` [m/s]."""
    reynolds = density * speed * diameter / viscosity
    over_stokes = max(1.0 + 0.15 * reynolds**0.687, NEWTON * reynolds)
    return 3.0 * math.pi * viscosity * diameter * over_stokes


def terminal_speed(weight: float, diameter: float, density: float, viscosity: float) -> float:
    """Speed [m/s] at which the drag on a sphere of `diameter` [m] bears its weight [N]."""
    low, high = 0.0, weight / (3.0 * math.pi * viscosity * diameter)  # Stokes' drag alone is less
    for _ in range(60):
        speed = 0.5 * (low + high)
        if resistance.py_func(density, viscosity, diameter, speed) * speed < weight:
            low = speed
        else:
            high = speed
    return speed


@njit(cache=True, error_model="numpy")
def apply_drag(n, particles, density, viscosity):
    """Add the drag on each particle; density [kg/m3], viscosity [Pa s]."""
    for i in range(n):
        k = particles.kinetic[i]
        diameter = 2.0 * k[6]
        speed = math.sqrt(k[0] * k[0] + k[1] * k[1] + k[2] * k[2])
        factor = resistance(density, viscosity, diameter, speed)
        for f in range(3):
            particles.force[i, f] -= factor * k[f]
