"""Leapfrog: velocities live at the half steps, positions at the full ones.

v(n+1/2) = v(n-1/2) + a(n) dt,   x(n+1) = x(n) + v(n+1/2) dt. Second order where forces depend on
position. Damping and sliding take the velocity of half a step earlier, which makes them first
order. Extrapolation of the velocity was tried. It lost a third of the largest stable step and
gained nothing at usual step sizes.

In float32 a velocity of 1 m/s has steps of 1e-7 m/s, as large as what gravity adds in a short time
step. What rounding leaves over is carried to the next step (Kahan 1965, Communications of the ACM
8:40), so that the sum is as good as one in float64.

The torque of rolling resistance on the own spin acts last and as dry friction: it takes at most the
spin that is there."""

import math

from numba import types

from dem.kernel.arithmetic import where
from dem.kernel.simd import (
    angular_square,
    fast_path,
    linear_lanes,
    load_row,
    move_row,
    spread,
    store_row,
)


def advance_particles(n, particles, gravity, dt):
    """Kick and drift all free particles; True when one has left its skin. Here in float64
    throughout."""
    force, inverse, kinetic = particles.force, particles.inverse, particles.kinetic
    position, drift, carry = particles.position, particles.drift, particles.carry
    zero, one, tiny = 0.0, 1.0, 1e-30
    gx, gy, gz = gravity[0] * dt, gravity[1] * dt, gravity[2] * dt
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


@fast_path(advance_particles, fastmath={"contract", "nsz"})
def _advance_rows(n, particles, gravity, dt):
    """A particle's velocity and spin at a time, float32 but for the positions."""
    force, inverse, kinetic = particles.force, particles.inverse, particles.kinetic
    position, drift, carry = particles.position, particles.drift, particles.carry
    real = types.float32
    zero, one, h = real(0.0), real(1.0), real(dt)
    fall = linear_lanes(real(gravity[0] * dt), real(gravity[1] * dt), real(gravity[2] * dt))
    along = spread(h, zero)
    stale = False
    for i in range(n):
        if particles.cluster[i] >= 0:
            continue
        motion, twist = load_row(kinetic, i), h * inverse[i, 1]
        turn = spread(h * inverse[i, 0], twist) * load_row(force, i) + fall
        free = motion + turn
        loss = zero  # share of the spin that the resistance takes
        most = twist * force[i, 6]
        if most > zero:
            square = angular_square(free)
            # what rests stays so: most grains of a heap need neither root nor division
            loss = one if most * most >= square else most / math.sqrt(square)
        taken = spread(zero, loss)
        gain = turn - taken * free + load_row(carry, i)
        after = motion + gain
        stopped = taken >= 1.0
        store_row(carry, i, where(stopped, 0.0, gain - (after - motion)))
        after = where(stopped, 0.0, after)
        store_row(kinetic, i, after)
        stale |= move_row(position, drift, i, along * after)
    return stale
