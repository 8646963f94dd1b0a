"""Coulomb friction with a floor: whatever touches holds at least a small force sideways."""

from dem.contact.export import Export
from dem.contact.law import Law, Parameter
from dem.kernel.arithmetic import law, maximum, where


@law
def limit(p, normal):
    """Largest tangential force [N] under a repulsive normal force [N]; none without a load."""
    return where(normal > 0.0, maximum(p.friction * normal, p.friction_floor), 0.0 * normal)


LAW = Law(
    slot="friction",
    name="rate_free",
    equation="max(μ F_n, F_floor)",
    source="made up for this page",
    kernels={"limit": limit},
    parameters=(
        Parameter(
            key="friction_floor_N",
            name="friction_floor",
            meaning="least tangential force of a loaded contact",
            limits={"ge": 0},
        ),
    ),
    constants=("friction_floor",),
    exports={"lammps": Export("floor", "floor", lambda pair: {"mu": pair.contact.static_friction})},
    left_out="NOT CONVERTED: friction rate_free; the coefficient is that without a floor.",
)
