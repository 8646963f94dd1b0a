"""Leapfrog: velocities live at the half steps, positions at the full ones.

v(n+1/2) = v(n-1/2) + a(n) dt,   x(n+1) = x(n) + v(n+1/2) dt.
Second order where forces depend on position. Damping and sliding see the velocity of half a step
earlier, which makes them first order; extrapolating it instead was tried and lost a third of the
largest stable step for no gain at usual step sizes.

In float32 a velocity of 1 m/s has steps of 1e-7 m/s, as large as what gravity adds in a short time
step. What rounding leaves over is carried to the next step (Kahan 1965, Communications of the ACM
8:40), so that the sum is as good as one in float64.

The torque of rolling resistance on the own spin acts last and as dry friction: it takes at most the
spin that is there."""

import math

from numba import njit


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
def advance_particles(n, particles, gravity, dt):
    """Kick and drift all free particles; True when one has left its skin."""
    force, inverse, kinetic = particles.force, particles.inverse, particles.kinetic
    position, drift, carry = particles.position, particles.drift, particles.carry
    # constants in the precision of the rows: a float64 one would widen every operation
    real = force.dtype.type
    zero, one, tiny = real(0.0), real(1.0), real(1e-30)
    gx, gy, gz = real(gravity[0] * dt), real(gravity[1] * dt), real(gravity[2] * dt)
    dt = real(dt)
    stale = False
    for i in range(n):
        if particles.cluster[i] >= 0:
            continue
        kick, twist = dt * inverse[i, 0], dt * inverse[i, 1]
        for c in range(3):
            gain = kick * force[i, c] + (gx if c == 0 else gy if c == 1 else gz) + carry[i, c]
            v = kinetic[i, c] + gain
            carry[i, c] = gain - (v - kinetic[i, c])
            kinetic[i, c] = v
            position[i, c] += dt * v
            drift[i, c] += dt * v
        path = drift[i, 0] * drift[i, 0] + drift[i, 1] * drift[i, 1] + drift[i, 2] * drift[i, 2]
        stale |= path > drift[i, 3]
        loss = zero  # share of the spin that the resistance takes
        if force[i, 6] > zero:
            a = kinetic[i, 3] + twist * force[i, 3]
            b = kinetic[i, 4] + twist * force[i, 4]
            c = kinetic[i, 5] + twist * force[i, 5]
            loss = twist * force[i, 6] / (math.sqrt(a * a + b * b + c * c) + tiny)
        for c in range(3, 6):
            if loss >= one:
                kinetic[i, c] = carry[i, c] = zero
                continue
            turn = twist * force[i, c]
            gain = turn - loss * (kinetic[i, c] + turn) + carry[i, c]
            w = kinetic[i, c] + gain
            carry[i, c] = gain - (w - kinetic[i, c])
            kinetic[i, c] = w
    return stale
