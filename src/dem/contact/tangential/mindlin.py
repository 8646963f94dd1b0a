"""Mindlin no-slip tangential spring with Coulomb limit.

The spring force grows by -S_t v_t dt, S_t = 8 G* a, and is scaled by a/a_before while the contact unloads. Keeping the
force rather than a displacement, and scaling it on unloading, is what keeps a varying stiffness from creating energy
(Thornton, Cummins, Cleary 2013, Powder Technology 233:30). A dashpot of the same form as the normal one acts beside the
spring; their sum is limited by friction.
"""

from dem.lanes import law, maximum, minimum, sqrt
from dem.vectors import dot, reject, scale, subtract

TINY = 1e-30


@law
def tangential_force(p, n, v_t, contact_radius, radius_before, m_eff, spring, limit, dt):
    """Tangential force on the first sphere and the new spring force, both (3,) [N].

    n unit normal; v_t relative tangential velocity (3,) [m/s]; contact_radius a [m]; spring (3,) [N]; limit [N]; dt
    [s].
    """
    stiffness = 8.0 * p.shear * contact_radius
    unloading = minimum(contact_radius / maximum(radius_before, TINY), 1.0)
    spring = scale(unloading, reject(spring, n))
    spring = subtract(spring, scale(stiffness * dt, v_t))
    spring = scale(minimum(limit / (sqrt(dot(spring, spring)) + TINY), 1.0), spring)
    force = subtract(spring, scale(p.damping * sqrt(stiffness * m_eff), v_t))
    force = scale(minimum(limit / (sqrt(dot(force, force)) + TINY), 1.0), force)
    return force, spring
