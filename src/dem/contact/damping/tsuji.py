"""Viscous damping whose restitution does not depend on the impact speed.

F = (4/3) E* sqrt(R*) overlap^(3/2) - factor sqrt(S_n m*) v_n,   factor = 2 sqrt(5/6) beta(e),
beta = -ln e / sqrt(ln^2 e + pi^2),   S_n = 2 E* sqrt(R* overlap).

Tsuji, Tanaka, Ishida (1992), Powder Technology 71:239, in the form that EDEM documents. The force
may pull at the end of the contact. Without that part the restitution would be larger (0.55 in place
of 0.5).
"""

import math

from dem.contact.export import Export
from dem.contact.law import Law
from dem.kernel.arithmetic import law, sqrt


def factor(restitution: float) -> float:
    """Dashpot factor 2 sqrt(5/6) beta for a coefficient of restitution in [0, 1]."""
    if restitution <= 0.0:
        return 2.0 * math.sqrt(5.0 / 6.0)
    log = math.log(restitution)
    return 2.0 * math.sqrt(5.0 / 6.0) * -log / math.hypot(log, math.pi)


@law
def damped(p, elastic, stiffness, overlap, r_eff, m_eff, v_n, deepest):
    """Elastic force less the dashpot [N], and the deepest overlap."""
    return elastic - p.damping * sqrt(stiffness * m_eff) * v_n, deepest


LAW = Law(
    slot="damping",
    name="tsuji",
    equation="−2√(5/6) β √(S_n m*) v_n, β = −ln e / √(ln² e + π²); may pull at the end, so e is "
    "met at any speed",
    source="Tsuji et al. (1992)",
    kernels={"damped": damped},
    constants=("damping",),
    values=lambda contact: {"damping": factor(contact.restitution)},
    only_with={"normal": ("hertz",)},
    exports={
        "liggghts": Export(
            numbers=lambda pair: {"coefficientRestitution": pair.contact.restitution}
        ),
        "lammps": Export(words="damping coeff_restitution"),
        "yade": Export(numbers=lambda pair: {"en": pair.contact.restitution}),
    },
    default=True,
)
