"""Constant directional torque on each particle's own spin: EDEM's standard rolling friction (type
A).

T_i = -mu_r F_n R_i omega_i / |omega_i|,  with R_i the particle's own radius.

All contacts of a particle oppose the same spin, so a contact hands over only the size of its
torque. The step sums the sizes and applies them after the other torques, as dry friction: the spin
is reduced by at most itself. It is never reversed and a sphere at rest stays at rest. Ai, Chen,
Rotter, Ooi (2011), Powder Technology 206:269.
The torques of the two spheres are not opposite, so angular momentum is not conserved.
"""

from dem.contact.export import Export
from dem.contact.law import Law
from dem.kernel.arithmetic import law


@law
def resistance(p, normal, radius):
    """Size of the resisting torque [N m] on a particle of `radius` [m] under a repulsive normal
    force [N]."""
    return p.rolling * normal * radius


LAW = Law(
    slot="rolling",
    name="constant_torque",
    equation="μ_r F_n R on each particle's own spin (EDEM's standard)",
    source="Ai et al. (2011), type A",
    kernels={"resistance": resistance},
    exports={
        "edem": Export("Hertz-Mindlin (no slip) with standard rolling friction"),
        "rocky": Export("type A: constant moment"),
    },
    holds_at_rest="brakes each grain's own spin, also where grains turn together and nothing rolls",
)
