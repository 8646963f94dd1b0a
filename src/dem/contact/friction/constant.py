"""Coulomb friction: the limit is mu times the normal force."""

from dem.arithmetic import law
from dem.contact.law import Law


@law
def limit(p, normal):
    """Largest tangential force [N] under a repulsive normal force [N]."""
    return p.friction * normal


LAW = Law(
    slot="friction",
    name="constant",
    equation="μ F_n",
    source="Coulomb",
    kernels={"limit": limit},
    default=True,
)
