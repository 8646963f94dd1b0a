"""The contact: one law from each slot, put together.

Everything here is written for floats and for lanes. `contact_force` knows a contact only by its
overlap, normal and relative motion; `pair_contact` and `wall_contact` work these out for two
spheres and for a sphere on a wall.

Velocities are those of half a step ago, places those of now (`dem.kernel.integrate`). So the slip
is taken across the normal of half a step ago, `earlier`: with that of now a pair that turns as a
whole would slip by its speed times half of the angle that it turns in a step, always towards its
axis.

History of a contact, dem.kernel.simd.FIELDS numbers:
    0-2 tangential spring force [N]     3-5 rolling spring moment [N m]
    6   contact radius at the last step [m], that of a neck too; BRIDGE while a liquid bridge spans
        a gap; 0 when there is no contact
    7   deepest overlap so far [m], or what else a damping law keeps of the contact
    8   torsion spring moment about the normal [N m]
"""

from dem.contact import dispatch
from dem.kernel.arithmetic import (
    TINY,
    add,
    cross,
    dot,
    law,
    maximum,
    minimum,
    narrow,
    only,
    reject,
    scale,
    sqrt,
    subtract,
    turned_about,
    where,
    widen,
)

BRIDGE = -1.0
INERTIA = 0.4  # of a solid sphere, in m r^2


@law
def is_active(codes, p, overlap, r_eff, grain, radius_before):
    """Return whether a contact transmits force: it touches, or a neck or bridge made by an earlier
    touch still holds.

    grain: radius [m] of the sphere on a wall, harmonic mean radius of two spheres.
    """
    active = overlap > 0.0
    if dispatch.spans_gap(codes):
        held = (radius_before > 0.0) | (radius_before < 0.0)
        active = active | (held & (overlap > -dispatch.reach(codes, p, r_eff, grain)))
    return active


@law
def normal_force(codes, p, overlap, r_eff, grain, m_eff, v_n, deepest):
    """Normal force, the part of it that loads the contact, contact radius, stiffness S_n and
    deepest overlap."""
    elastic, stiffness, radius, deepest, adhesion = dispatch.normal(
        codes, p, overlap, r_eff, deepest
    )
    pressed = maximum(overlap, 0.0)
    force, deepest = dispatch.damped(
        codes, p, elastic, stiffness, pressed, r_eff, grain, m_eff, v_n, deepest
    )
    load = maximum(force + adhesion, 0.0)
    force = force - dispatch.attraction(codes, p, overlap, r_eff, grain)
    return force, load, radius, stiffness, deepest


@law
def contact_force(
    codes, p, dt, overlap, n, r_eff, grain, m_eff, inertia, velocity, spin, about, history
):
    """Force and torque of rolling and torsion on the first body of a contact, and the contact's new
    history.

    overlap [m]; n (3,) unit normal from the second body to the first; r_eff R* [m]; grain: radius
    [m] of the sphere on a wall, harmonic mean radius of two spheres; velocity (3,) of the first
    relative to the second at the contact [m/s]; spin (3,) omega_1 - omega_2 [rad/s]; about: what
    both turn by about the normal, n . (omega_1 + omega_2)/2 [rad/s]; inertia I1 I2/(I1+I2) [kg m2];
    history (FIELDS,).
    The springs turn with the pair: by `about` here, and with the normal where a law takes what
    lies across it. So a contact that turns as a whole, as on a turntable, is the same contact
    (objectivity; Luding 2008, Granular Matter 10:235, section 2.2.2).
    Returns force (3,) [N], torque (3,) [N m], load [N], history (FIELDS,).
    """
    active = is_active(codes, p, overlap, r_eff, grain, history[6])
    v_n = dot(velocity, n)
    force, load, radius, stiffness, deepest = normal_force(
        codes, p, overlap, r_eff, grain, m_eff, v_n, history[7]
    )
    force, load = where(active, force, 0.0), where(active, load, 0.0)
    slip = subtract(velocity, scale(v_n, n))
    most = dispatch.limit(codes, p, load, slip, grain)
    turn = about * dt
    spring = turned_about(history[:3], n, turn)
    along, spring = dispatch.tangential(
        codes, p, n, slip, stiffness, radius, history[6], m_eff, spring, most, dt
    )
    unloading = minimum(radius / maximum(history[6], TINY), 1.0)
    moment = turned_about(history[3:6], n, turn)
    torque, moment = dispatch.rolling(
        codes, p, n, spin, load, stiffness, unloading, r_eff, inertia, moment, dt
    )
    twisting, twist = dispatch.torsion(
        codes, p, dot(spin, n), radius, unloading, m_eff, history[8], most, dt
    )
    torque = add(torque, scale(twisting, n))
    memory = where(radius > 0.0, radius, BRIDGE)
    history = only(active, spring) + only(active, moment) + only(active, (memory, deepest, twist))
    return add(scale(force, n), along), torque, load, history


@law
def pair_overlap(separation, r_i, r_j):
    """Overlap of two spheres [m] and the inverse of their centres' distance [1/m]; separation (3,)
    is exact to float64.

    (reach^2 - d^2) / (reach + d): the difference of two nearly equal lengths is taken in float64.
    One division serves both results.
    """
    squared = dot(separation, separation)
    distance = sqrt(narrow(squared))
    reach = widen(r_i) + widen(r_j)
    both = r_i + r_j + distance
    shared = 1.0 / (both * distance)
    return narrow(reach * reach - squared) * (distance * shared), both * shared


@law
def pair_is_active(codes, p, overlap, r_i, r_j, radius_before):
    """Return whether two spheres act on each other, or did at the last step and must now forget
    it."""
    r_eff = r_i * r_j / (r_i + r_j)
    touching = is_active(codes, p, overlap, r_eff, 2.0 * r_eff, radius_before)
    return touching | (radius_before > 0.0) | (radius_before < 0.0)


@law
def pair_contact(codes, p, dt, separation, inverse, overlap, first, second, history):
    """Two spheres in contact.

    separation (3,): position of the first minus the second [m]; inverse, overlap: of `pair_overlap`
    [1/m], [m]; first, second (8,): velocity, spin, radius, mass. Returns the force columns
    (8,) for each sphere (force, torque, rolling resistance, load) and the new history (FIELDS,).
    """
    r_i, m_i, r_j, m_j = first[6], first[7], second[6], second[7]
    x, y, z = separation
    n = (narrow(x) * inverse, narrow(y) * inverse, narrow(z) * inverse)
    radii, masses = r_i + r_j, m_i + m_j
    shared = 1.0 / (radii * masses)  # one division serves both
    r_eff, m_eff = r_i * r_j * (masses * shared), m_i * m_j * (radii * shared)
    inertia_i, inertia_j = INERTIA * m_i * r_i * r_i, INERTIA * m_j * r_j * r_j
    # the product of two moments of fine grains is less than float32 holds
    inertia = inertia_i * (inertia_j / (inertia_i + inertia_j))
    arm_i, arm_j = r_i - 0.5 * overlap, r_j - 0.5 * overlap
    w_i, w_j, v = first[3:6], second[3:6], subtract(first[:3], second[:3])
    earlier = subtract(n, scale(0.5 * dt * inverse, v))
    surface = cross(add(scale(arm_i, w_i), scale(arm_j, w_j)), earlier)
    velocity = subtract(v, reject(surface, n))
    about, spin = 0.5 * dot(add(w_i, w_j), n), subtract(w_i, w_j)
    force, turning, load, history = contact_force(
        codes, p, dt, overlap, n, r_eff, 2.0 * r_eff, m_eff, inertia, velocity, spin, about, history
    )
    twist = cross(n, force)
    t_i = subtract(turning, scale(arm_i, twist))
    t_j = subtract(scale(-1.0, turning), scale(arm_j, twist))
    resist_i = dispatch.resistance(codes, p, load, r_i)
    resist_j = dispatch.resistance(codes, p, load, r_j)
    on_first = force + t_i + (resist_i, load)
    on_second = (-force[0], -force[1], -force[2]) + t_j + (resist_j, load)
    return on_first, on_second, history


@law
def wall_contact(codes, p, dt, geometry, turning, particle, history):
    """A sphere on a wall, which counts as a sphere of infinite radius and mass.

    geometry: overlap [m], normal (3,), velocity of the wall (3,) at the contact point [m/s];
    turning: spin of the wall (3,) [rad/s]; particle (8,) as in `pair_contact`. Returns the force
    columns (8,) on the sphere, the torque of rolling and torsion in them (3,) and the new history
    (FIELDS,).
    """
    overlap, n, wall_velocity, wall_spin = geometry[0], geometry[1:4], geometry[4:7], turning[:3]
    radius, mass = particle[6], particle[7]
    arm = radius - overlap
    spin, velocity = particle[3:6], subtract(particle[:3], wall_velocity)
    earlier = subtract(n, scale(0.5 * dt, cross(wall_spin, n)))
    velocity = subtract(velocity, scale(arm, reject(cross(spin, earlier), n)))
    inertia = INERTIA * mass * radius * radius
    about, spin = 0.5 * dot(add(spin, wall_spin), n), subtract(spin, wall_spin)
    force, torque, load, history = contact_force(
        codes, p, dt, overlap, n, radius, radius, mass, inertia, velocity, spin, about, history
    )
    whole = subtract(torque, scale(arm, cross(n, force)))
    return force + whole + (dispatch.resistance(codes, p, load, radius), load), torque, history
