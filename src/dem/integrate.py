"""Leapfrog: velocities at the half step, positions at the full one.

v(n+1/2) = v(n-1/2) + a(n) dt,   x(n+1) = x(n) + v(n+1/2) dt.
Forces that depend on velocity are given v(n+1) extrapolated from the last two half steps, so damping too is second order.

The torque of rolling resistance on the own spin acts last and as dry friction: it takes at most the spin that is there.
"""

import math

from numba import njit


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def advance_particles(n, particles, gx, gy, gz, dt):
    """Kick and drift all free particles; True when one has left its skin."""
    stale = False
    for i in range(n):
        if particles.cluster[i] >= 0:
            continue
        f, h, k = particles.force[i], particles.half[i], particles.kinetic[i]
        p, d = particles.position[i], particles.drift[i]
        kick, twist = dt * h[6], dt * h[7]
        u, v, w = h[0], h[1], h[2]
        h[0] = u + (kick * f[0] + dt * gx)
        h[1] = v + (kick * f[1] + dt * gy)
        h[2] = w + (kick * f[2] + dt * gz)
        k[0] = h[0] + 0.5 * (h[0] - u)
        k[1] = h[1] + 0.5 * (h[1] - v)
        k[2] = h[2] + 0.5 * (h[2] - w)
        dx, dy, dz = dt * h[0], dt * h[1], dt * h[2]
        p[0] += dx
        p[1] += dy
        p[2] += dz
        d[0] += dx
        d[1] += dy
        d[2] += dz
        stale |= d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > d[3]
        a, b, c = h[3], h[4], h[5]
        h[3] = a + twist * f[3]
        h[4] = b + twist * f[4]
        h[5] = c + twist * f[5]
        if f[6] > 0.0:
            spin = math.sqrt(h[3] * h[3] + h[4] * h[4] + h[5] * h[5])
            keep = max(0.0, 1.0 - twist * f[6] / (spin + 1e-30))
            h[3] *= keep
            h[4] *= keep
            h[5] *= keep
            k[3], k[4], k[5] = h[3], h[4], h[5]
        else:
            k[3] = h[3] + 0.5 * (h[3] - a)
            k[4] = h[4] + 0.5 * (h[4] - b)
            k[5] = h[5] + 0.5 * (h[5] - c)
    return stale
