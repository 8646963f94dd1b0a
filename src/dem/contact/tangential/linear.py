"""Linear tangential spring with Coulomb limit: S_t is a fixed share of the normal stiffness.

The spring force grows by -S_t v_t dt, S_t = kappa S_n; a dashpot of the form of the normal one acts
beside it, and friction limits their sum. kappa 2/7: Silbert et al. (2001), Physical Review E
64:051302. S_n is constant under the normal laws that go with it, so nothing is to be scaled while
the contact unloads.
"""

from dem.contact.law import Law, Parameter
from dem.contact.tangential.mindlin import settled
from dem.kernel.arithmetic import at_most, law, reject, scale, sqrt, subtract


@law
def force(p, n, v_t, stiffness, contact_radius, radius_before, m_eff, spring, limit, dt):
    """Tangential force on the first sphere and the new spring force, both (3,) [N]."""
    tangential = p.stiffness_ratio * stiffness
    spring = subtract(reject(spring, n), scale(tangential * dt, v_t))
    spring = at_most(limit, spring)
    dashpot = settled(p.damping * sqrt(tangential * m_eff), m_eff, dt)
    whole = subtract(spring, scale(dashpot, v_t))
    return at_most(limit, whole), spring


LAW = Law(
    slot="tangential",
    name="linear",
    equation="spring force grows by −κ S_n v_t dt, limited by friction",
    source="Cundall, Strack (1979); Silbert et al. (2001)",
    kernels={"tangential": force},
    parameters=(
        Parameter(
            key="tangential_stiffness_ratio",
            name="stiffness_ratio",
            meaning="tangential over normal stiffness",
            limits={"gt": 0, "le": 1},
            default=2.0 / 7.0,
        ),
    ),
    constants=("stiffness_ratio", "damping"),
    left_out="NOT CONVERTED: tangential linear; the exported spring is that of Mindlin.",
)
