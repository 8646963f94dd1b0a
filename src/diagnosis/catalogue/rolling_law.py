"""Rolling friction with a spring, in place of a constant torque."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, set_law


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Type C in place of type A; the strength is the rolling stiffness in units of the contact's.

    With torsion, or grains that spin about the normal of their contact would keep a heap from rest.
    """
    twisting = set_law(spec, "torsion", "marshall")
    return set_law(twisting, "rolling", "elastic_plastic", rolling_stiffness_factor=strength)


MECHANISM = Mechanism(
    name="rolling_law",
    description="grains at rest are held by a rolling spring, as angular ones are; a constant "
    "torque lets them creep",
    source="Ai, Chen, Rotter, Ooi (2011), Powder Technol. 206:269",
    experiments=("heap", "shear"),
    strength=Strength("rolling stiffness factor", "1", 0.5, 4.0, log=True),
    apply=apply,
)
