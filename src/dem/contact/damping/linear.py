"""Linear dashpot: F = k overlap - 2 beta sqrt(k m*) v_n, beta = -ln e / sqrt(ln^2 e + pi^2).

With a linear spring an impact is half a period of a damped oscillator and returns e at any speed.
The force may pull at the end of the contact, as in `tsuji`. Across a gap that a bridge spans there
is no dashpot.
"""

import math

from dem.contact.law import Law
from dem.kernel.arithmetic import law, sqrt, where


def factor(restitution: float) -> float:
    """Dashpot factor 2 beta for a coefficient of restitution in [0, 1]."""
    if restitution <= 0.0:
        return 2.0
    log = math.log(restitution)
    return 2.0 * -log / math.hypot(log, math.pi)


@law
def damped(p, elastic, stiffness, overlap, r_eff, m_eff, v_n, deepest):
    """Elastic force less the dashpot [N], and the deepest overlap."""
    dashpot = p.damping * sqrt(stiffness * m_eff) * v_n
    return elastic - where(overlap > 0.0, dashpot, 0.0 * dashpot), deepest


LAW = Law(
    slot="damping",
    name="linear",
    equation="−2β √(k m*) v_n, β = −ln e / √(ln² e + π²)",
    source="Cundall, Strack (1979)",
    kernels={"damped": damped},
    constants=("damping",),
    values=lambda contact: {"damping": factor(contact.restitution)},
    only_with={"normal": ("linear",)},
    left_out="NOT CONVERTED: damping linear; the exported dashpot is that of a Hertz contact, for "
    "the same e.",
)
