"""What a force law may know of the two materials in contact, and the choice of laws.

Both are fixed for a run. One `PairProperties` holds for every contact of one pair of materials.
"""

from typing import NamedTuple

from dem.lanes import law


class LawCodes(NamedTuple):
    """Integer choice of one law in each slot; the numbers are given in `dem.contact.registry`."""

    damping: int
    friction: int
    rolling: int
    cohesion: int
    torsion: int


class PairProperties(NamedTuple):
    """Material constants of a pair; SI units. A law that is not chosen leaves its constants at zero."""

    young: float
    """Effective Young's modulus E*, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 [Pa]."""
    shear: float
    """Effective shear modulus G*, 1/G* = (2 - nu1)/G1 + (2 - nu2)/G2 [Pa]."""
    damping: float
    """Dashpot factor that multiplies sqrt(stiffness * effective mass) [-]."""
    friction: float
    """Coefficient of static (sliding) friction [-]."""
    rolling: float
    """Coefficient of rolling friction [-]."""
    cohesion: float
    """SJKR: cohesion energy density [J/m3]; JKR: surface energy per surface [J/m2]; bridge: surface tension [N/m]."""
    wetting: float
    """Liquid bridge: cosine of the contact angle [-]."""
    liquid: float
    """Liquid bridge: volume of the bridge over that of the grain [-]."""
    bridge_reach: float
    """Liquid bridge: rupture distance over the radius of the grain [-]."""
    viscous_time: float
    """Viscoelastic law: dissipation time A [s]."""
    yield_pressure: float
    """Plastic law: contact pressure at which yield begins [Pa]."""
    friction_exponent: float
    """Load-dependent friction: n in mu = mu0 (F/F0)^-n [-]."""
    friction_reference: float
    """Load-dependent friction: F0 [N]."""
    rolling_stiffness: float
    """Elastic-plastic rolling: k_r = factor * k_n * (mu_r R)^2 [-]."""
    rolling_damping: float
    """Elastic-plastic rolling: damping ratio eta_r [-]."""
    rolling_limit: float
    """Elastic-plastic rolling: largest k_r dt^2/I that a grain among its neighbours bears [-]."""


N_PROPERTIES = len(PairProperties._fields)
assert N_PROPERTIES == 16


@law
def properties_of(table, pair):
    """Row `pair` of table (n_pairs, N_PROPERTIES) float64 as named properties."""
    t = table[pair]
    return PairProperties(
        t[0],
        t[1],
        t[2],
        t[3],
        t[4],
        t[5],
        t[6],
        t[7],
        t[8],
        t[9],
        t[10],
        t[11],
        t[12],
        t[13],
        t[14],
        t[15],
    )
