"""Motion of the walls' bodies: prescribed, or free along one axis under a load (the lid of a shear
box)."""

import math

from numba import njit


@njit(cache=True)
def rotate(rotation, wx, wy, wz, dt):
    """Turn a rotation matrix (3, 3) in place by the angle |w| dt about w (Rodrigues)."""
    w = math.sqrt(wx * wx + wy * wy + wz * wz)
    angle = w * dt
    if angle == 0.0:
        return
    ax, ay, az = wx / w, wy / w, wz / w
    s, c = math.sin(angle), math.cos(angle)
    for k in range(3):
        x, y, z = rotation[0, k], rotation[1, k], rotation[2, k]
        along = (ax * x + ay * y + az * z) * (1.0 - c)
        rotation[0, k] = c * x + s * (ay * z - az * y) + along * ax
        rotation[1, k] = c * y + s * (az * x - ax * z) + along * ay
        rotation[2, k] = c * z + s * (ax * y - ay * x) + along * az


@njit(cache=True)
def move_bodies(walls, gravity, dt, allowance):
    """Advance all bodies by one step; True when one has travelled further than its allowance (b,)
    [m]."""
    stale = False
    for b in range(len(walls.mass)):
        v, w, axis = walls.velocity[b], walls.spin[b], walls.axis[b]
        if walls.mass[b] > 0.0:
            push = walls.load[b]
            along = 0.0
            for k in range(3):
                push += axis[k] * (walls.force[b, k] + walls.mass[b] * gravity[k])
                along += axis[k] * v[k]
            before = along
            # implicit in the drag, so that a large one is stable
            along = (along + dt * push / walls.mass[b]) / (1.0 + dt * walls.drag[b] / walls.mass[b])
            for k in range(3):
                v[k] = v[k] - before * axis[k] + along * axis[k]
        speed = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        turn = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        for k in range(3):
            walls.impulse[b, k] += walls.force[b, k] * dt
            walls.angular_impulse[b, k] += walls.torque[b, k] * dt
        if speed == 0.0 and turn == 0.0:
            continue
        for k in range(3):
            walls.origin[b, k] += v[k] * dt
        rotate(walls.rotation[b], w[0], w[1], w[2], dt)
        walls.travel[b] += (speed + turn * walls.extent[b]) * dt
        stale = stale or walls.travel[b] > allowance[b]
    return stale
