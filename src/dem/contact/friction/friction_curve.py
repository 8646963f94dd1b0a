"""Friction whose coefficient is a free curve of load, sliding speed and grain size.

The limit is mu(s) F_n with s = (F_n / 1 N)^a (u / 1 m/s)^b (d / 1 mm)^c, u the speed of sliding at
the contact and d the diameter of the grain on a wall, of two grains the harmonic mean. At the five
states of the curve (`dem.contact.curve`) mu is the contact's static friction times the share given
there. So static friction 1 makes the shares coefficients.

a is `friction_curve_load_power` (1 unless given), b `friction_curve_speed_power` (0), c
`friction_curve_size_power` (0). The states reach from `friction_curve_low` to
`friction_curve_ratio` times that. The shares are `friction_curve_1` to `_5` between grains,
`wall_friction_curve_1` to `_5` on walls; 1 unless given.
"""

from dem.contact.curve import curve, declared, logarithm
from dem.contact.law import Law
from dem.kernel.arithmetic import dot, law, sqrt

CURVE = declared(
    "friction_curve",
    "static friction",
    {("load", "F_n / 1 N"): 1.0, ("speed", "u / 1 m/s"): 0.0, ("size", "d / 1 mm"): 0.0},
    lambda contact, share: contact.static_friction * share,
)


@law
def limit(p, normal, v_t, grain):
    """Largest tangential force [N] under a repulsive normal force [N] at a sliding velocity (3,)
    [m/s]."""
    place = p.friction_curve_start + p.friction_curve_load * logarithm(normal)
    place = place + p.friction_curve_speed * logarithm(sqrt(dot(v_t, v_t)))
    place = place + p.friction_curve_size * logarithm(2e3 * grain)
    differences = (
        p.friction_curve_d0,
        p.friction_curve_d1,
        p.friction_curve_d2,
        p.friction_curve_d3,
        p.friction_curve_d4,
    )
    return curve(place, differences, p.friction_curve_least, p.friction_curve_most) * normal


LAW = Law(
    slot="friction",
    name="friction_curve",
    equation="μ(F_n^a u^b d^c) F_n, u the speed of sliding",
    source="a free curve through five values",
    kernels={"limit": limit},
    **CURVE,
    left_out="NOT CONVERTED: friction friction_curve; the coefficient is that of the contact.",
)
