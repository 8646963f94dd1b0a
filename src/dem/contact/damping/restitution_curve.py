"""Restitution as a free curve of impact speed and grain size.

The dashpot is that of `tsuji`, with the factor for a restitution e(s) that each contact has from
its first touch on: s = (v / 1 m/s)^a (d / 1 mm)^b, v the normal speed of approach at that touch and
d the diameter of the grain on a wall, of two grains the harmonic mean. The contact keeps v until
the spheres part. At the five states of the curve (`dem.contact.curve`) e is the contact's
restitution times the share given there, at most 1; the factor is what runs between them. So
restitution 1 makes the shares restitutions.

a is `restitution_curve_speed_power` (1 unless given), b `restitution_curve_size_power` (0): speed
alone is (1, 0), size alone (0, 1), their product (1, 1). The states reach from
`restitution_curve_low` to `restitution_curve_ratio` times that. The shares are
`restitution_curve_1` to `_5` between grains, `wall_restitution_curve_1` to `_5` on walls; 1 unless
given.
"""

from dem.contact.curve import TINY, curve, declared, logarithm
from dem.contact.damping.tsuji import factor
from dem.contact.law import Law
from dem.kernel.arithmetic import law, maximum, sqrt, where


def dashpot(contact, share):
    """Factor of `tsuji` for a share of the contact's restitution."""
    return factor(min(contact.restitution * share, 1.0))


CURVE = declared(
    "restitution_curve",
    "restitution",
    {("speed", "v / 1 m/s"): 1.0, ("size", "d / 1 mm"): 0.0},
    dashpot,
)


@law
def damped(p, elastic, stiffness, overlap, grain, m_eff, v_n, deepest):
    """Elastic force less the dashpot [N], and the speed of approach at the first touch [m/s], which
    the contact keeps in place of the deepest overlap."""
    speed = where(deepest > 0.0, deepest, maximum(-v_n, TINY))
    speed = where(overlap > 0.0, speed, 0.0 * speed)
    place = p.restitution_curve_start + p.restitution_curve_speed * logarithm(speed)
    place = place + p.restitution_curve_size * logarithm(2e3 * grain)
    differences = (
        p.restitution_curve_d0,
        p.restitution_curve_d1,
        p.restitution_curve_d2,
        p.restitution_curve_d3,
        p.restitution_curve_d4,
    )
    damping = curve(place, differences, p.restitution_curve_least, p.restitution_curve_most)
    return elastic - damping * sqrt(stiffness * m_eff) * v_n, speed


LAW = Law(
    slot="damping",
    name="restitution_curve",
    equation="the dashpot of `tsuji` for e(v^a d^b), v the speed at the first touch",
    source="a free curve through five values",
    kernels={"damped": damped},
    parameters=CURVE["parameters"],
    constants=CURVE["constants"],
    # the tangential spring's dashpot is that of the middle
    values=lambda contact: (
        {"damping": dashpot(contact, contact.restitution_curve_3)} | CURVE["values"](contact)
    ),
    only_with={"normal": ("hertz",)},
    left_out="NOT CONVERTED: damping restitution_curve; the constant coefficient of restitution "
    "stands in its place.",
)
