"""Leapfrog: velocities at the half step, positions at the full one.

v(n+1/2) = v(n-1/2) + a(n) dt,   x(n+1) = x(n) + v(n+1/2) dt.
Forces that depend on velocity are given v(n+1) extrapolated from the last two half steps, so damping too is second
order.

The torque of rolling resistance on the own spin acts last and as dry friction: it takes at most the spin that is there.
"""

import math

from numba import njit


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
def advance_particles(n, particles, gravity, dt):
    """Kick and drift all free particles; True when one has left its skin."""
    force, half, kinetic = particles.force, particles.half, particles.kinetic
    position, drift = particles.position, particles.drift
    # constants in the precision of the rows: a float64 one would widen every operation
    real = half.dtype.type
    ahead, zero, one, tiny = real(0.5), real(0.0), real(1.0), real(1e-30)
    gx, gy, gz = real(gravity[0] * dt), real(gravity[1] * dt), real(gravity[2] * dt)
    dt = real(dt)
    stale = False
    for i in range(n):
        if particles.cluster[i] >= 0:
            continue
        kick, twist = dt * half[i, 6], dt * half[i, 7]
        for c in range(3):
            before = half[i, c]
            v = before + (kick * force[i, c] + (gx if c == 0 else gy if c == 1 else gz))
            half[i, c] = v
            kinetic[i, c] = v + ahead * (v - before)
            position[i, c] += dt * v
            drift[i, c] += dt * v
        path = drift[i, 0] * drift[i, 0] + drift[i, 1] * drift[i, 1] + drift[i, 2] * drift[i, 2]
        stale |= path > drift[i, 3]
        a0, b0, c0 = half[i, 3], half[i, 4], half[i, 5]
        a, b, c = a0 + twist * force[i, 3], b0 + twist * force[i, 4], c0 + twist * force[i, 5]
        if force[i, 6] > zero:
            spin = math.sqrt(a * a + b * b + c * c)
            keep = max(zero, one - twist * force[i, 6] / (spin + tiny))
            a, b, c = a * keep, b * keep, c * keep
            kinetic[i, 3], kinetic[i, 4], kinetic[i, 5] = a, b, c
        else:
            kinetic[i, 3] = a + ahead * (a - a0)
            kinetic[i, 4] = b + ahead * (b - b0)
            kinetic[i, 5] = c + ahead * (c - c0)
        half[i, 3], half[i, 4], half[i, 5] = a, b, c
    return stale
