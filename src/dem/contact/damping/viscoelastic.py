"""Viscoelastic spheres: 1 - e grows as v^(1/5).

F = k (overlap^(3/2) + (3/2) A sqrt(overlap) d(overlap)/dt),   k = (4/3) E* sqrt(R*), not
attractive.

Brilliantov, Spahn, Hertzsch, Poeschel (1996), Physical Review E 53:5382. A is the dissipation time.
(3/2) k sqrt(overlap) is the contact stiffness S_n, so the dissipative part is -A S_n v_n.
"""

from dem.contact.damping.tsuji import factor
from dem.contact.law import Law, Parameter
from dem.kernel.arithmetic import law, maximum


@law
def damped(p, elastic, stiffness, overlap, r_eff, m_eff, v_n, deepest):
    """Elastic force less the viscous part, never attractive [N], and the deepest overlap."""
    return maximum(elastic - p.viscous_time * stiffness * v_n, 0.0), deepest


LAW = Law(
    slot="damping",
    name="viscoelastic",
    equation="−A S_n v_n: 1 − e grows as v^(1/5)",
    source="Brilliantov et al. (1996)",
    kernels={"damped": damped},
    parameters=(Parameter("viscoelastic_time_s", "viscous_time", "dissipation time A", {"gt": 0}),),
    constants=("viscous_time",),
    values=lambda contact: {"damping": factor(contact.restitution)},  # of the tangential spring
    only_with={"normal": ("hertz",)},
    left_out="NOT CONVERTED: damping viscoelastic, whose restitution depends on the impact speed; "
    "the constant coefficient of restitution stands in its place.",
)
