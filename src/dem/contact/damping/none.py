"""No dashpot: the normal law alone, which may dissipate by its own loading path."""

from dem.contact.law import Law
from dem.kernel.arithmetic import law


@law
def damped(p, elastic, stiffness, overlap, r_eff, m_eff, v_n, deepest):
    """The elastic force as it is [N], and the deepest overlap."""
    return elastic, deepest


LAW = Law(
    slot="damping",
    name="none",
    equation="no dashpot",
    kernels={"damped": damped},
)
