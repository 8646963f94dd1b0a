"""Restitution of contacts that yield; below the yield speed that of the base model holds."""

from diagnosis.catalogue import Mechanism, Strength, setting

MECHANISM = Mechanism(
    name="plastic_restitution",
    description="restitution falls as the inverse fourth root of speed, above the speed at "
    "which the contact yields",
    source="Thornton (1997), J. Appl. Mech. 64:383",
    experiments=("drop",),
    strength=Strength("yield speed", "m/s", 0.1, 4.0, log=True, off=4.0),
    apply=setting("damping", "plastic", "yield_velocity_m_s"),
    law=("restitution", ("speed",)),
)
