"""Restitution that falls with speed because the contact yields."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, set_law


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Elastic-plastic contact; the restitution of the base model holds below the yield speed."""
    return set_law(spec, "damping", "plastic", yield_velocity_m_s=strength)


MECHANISM = Mechanism(
    name="plastic_restitution",
    description="restitution falls as the inverse fourth root of speed, above the speed at which "
    "the contact yields",
    source="Thornton (1997), J. Appl. Mech. 64:383",
    experiments=("drop",),
    levers=("drop_height_mm",),
    strength=Strength("yield speed", "m/s", 0.1, 4.0, log=True, off=4.0),
    apply=apply,
    law=("restitution", ("speed",)),
)
