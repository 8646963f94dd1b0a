"""Coulomb friction: the limit is mu times the normal force."""

import math

from dem.contact.export import Export
from dem.contact.law import Law
from dem.kernel.arithmetic import law


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
    exports={
        "liggghts": Export(
            numbers=lambda pair: {"coefficientFriction": pair.contact.static_friction}
        ),
        "lammps": Export(numbers=lambda pair: {"mu": pair.contact.static_friction}),
        "yade": Export(
            numbers=lambda pair: {"frictAngle": math.atan(pair.contact.static_friction)}
        ),
        "mercurydpm": Export(
            numbers=lambda pair: {"SlidingFrictionCoefficient": pair.contact.static_friction}
        ),
    },
    default=True,
)
