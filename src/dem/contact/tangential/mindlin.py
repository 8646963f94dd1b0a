"""Mindlin no-slip tangential spring with Coulomb limit.

The spring force grows by -S_t v_t dt, S_t = 8 G* a, and is scaled by a/a_before while the contact
unloads. Keeping the force rather than a displacement, and scaling it on unloading, is what keeps a
varying stiffness from creating energy (Thornton, Cummins, Cleary 2013, Powder Technology 233:30). A
dashpot of the same form as the normal one acts beside the spring; their sum is limited by friction.
"""

import math

from dem.contact.export import Export
from dem.contact.law import Law
from dem.kernel.arithmetic import maximum, minimum, sqrt
from dem.kernel.decorator import law
from dem.kernel.vectors import TINY, at_most, reject, scale, subtract

MERCURY = 2.0 / 3.0
"""Of 8 G a, which is its spring of a displacement."""


@law
def tangential_force(p, n, v_t, stiffness, contact_radius, radius_before, m_eff, spring, limit, dt):
    """Tangential force on the first sphere and the new spring force, both (3,) [N].

    n unit normal; v_t relative tangential velocity (3,) [m/s]; contact_radius a [m]; spring (3,)
    [N]; limit [N]; dt [s].
    """
    tangential = 8.0 * p.shear * contact_radius
    unloading = minimum(contact_radius / maximum(radius_before, TINY), 1.0)
    spring = scale(unloading, reject(spring, n))
    spring = subtract(spring, scale(tangential * dt, v_t))
    spring = at_most(limit, spring)
    force = subtract(spring, scale(p.damping * sqrt(tangential * m_eff), v_t))
    return at_most(limit, force), spring


LAW = Law(
    slot="tangential",
    name="mindlin",
    equation="spring force grows by −8 G* a v_t dt, is scaled by a/a' on unloading, limited by "
    "friction",
    source="Mindlin (1949); Thornton et al. (2013)",
    kernels={"tangential": tangential_force},
    constants=("damping",),
    remembers="the spring force and the contact radius",
    exports={
        "liggghts": Export(words="tangential history"),
        "lammps": Export(
            words="tangential mindlin_rescale/force",
            numbers=lambda pair: {
                "k": 8.0 * pair.shear,
                "x": 2.0 * math.sqrt(pair.shear / pair.young),
            },
        ),
        "mercurydpm": Export(
            numbers=lambda pair: {
                "EffectiveShearModulus": pair.shear / MERCURY,
                "SlidingDissipation": pair.dashpot * math.sqrt(MERCURY),
            }
        ),
    },
    default=True,
)
