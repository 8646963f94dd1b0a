"""Mindlin no-slip tangential spring with Coulomb limit.

The spring force grows by -S_t v_t dt, S_t = 8 G* a, and is scaled by a/a_before while the contact
unloads. Keeping the force rather than a displacement, and scaling it on unloading, is what keeps a
varying stiffness from creating energy (Thornton, Cummins, Cleary 2013, Powder Technology 233:30). A
dashpot of the same form as the normal one acts beside the spring; their sum is limited by friction.

The slip is that of half a step ago, the mean over the step that ends now. So while the contact
loads the spring grows by the stiffness in the middle of that step, which makes it second order.
"""

import math

from dem.contact.export import Export
from dem.contact.law import Law
from dem.kernel.arithmetic import (
    TINY,
    at_most,
    law,
    maximum,
    minimum,
    reject,
    scale,
    sqrt,
    subtract,
)

SLIP = 3.5
"""Over 1/m*, how readily a force at the contact of two solid spheres changes their slip: 1 +
m r^2/I."""

MERCURY = 2.0 / 3.0
"""Of 8 G a, which is its spring of a displacement."""


@law
def settled(dashpot, m_eff, dt):
    """Coefficient [N s/m] of a tangential dashpot for a slip that is half a step old.

    The dashpot is that of the slip at the end of the step that its own force makes: backward Euler,
    for two spheres that nothing else touches. With the old slip it alone would make a grain with
    several contacts tremble, where the restitution is low.
    """
    return dashpot * m_eff / maximum(m_eff + SLIP * dt * dashpot, TINY)


@law
def tangential_force(p, n, v_t, stiffness, contact_radius, radius_before, m_eff, spring, limit, dt):
    """Tangential force on the first sphere and the new spring force, both (3,) [N].

    n unit normal; v_t relative tangential velocity (3,) [m/s]; contact_radius a [m]; spring (3,)
    [N]; limit [N]; dt [s].
    """
    before = maximum(radius_before, TINY)  # a liquid bridge has none
    unloading = minimum(contact_radius / before, 1.0)
    spring = scale(unloading, reject(spring, n))
    middle = 0.5 * (contact_radius + minimum(before, contact_radius))
    spring = subtract(spring, scale(8.0 * p.shear * middle * dt, v_t))
    spring = at_most(limit, spring)
    dashpot = p.damping * sqrt(8.0 * p.shear * contact_radius * m_eff)
    force = subtract(spring, scale(settled(dashpot, m_eff, dt), v_t))
    return at_most(limit, force), spring


LAW = Law(
    slot="tangential",
    name="mindlin",
    equation="spring force grows by −8 G* a v_t dt, is scaled by a/a' on unloading, limited by "
    "friction",
    source="Mindlin (1949); Thornton et al. (2013)",
    kernels={"tangential": tangential_force},
    constants=("damping",),
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
