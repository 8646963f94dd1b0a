"""Restitution that falls with speed because the grain's material is viscous."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, set_law


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """The viscoelastic dashpot in place of the one with a constant restitution."""
    return set_law(spec, "damping", "viscoelastic", viscoelastic_time_s=strength)


MECHANISM = Mechanism(
    name="viscoelastic_restitution",
    description="restitution falls with impact speed, 1 - e growing as its fifth root",
    source="Brilliantov, Spahn, Hertzsch, Poeschel (1996), Phys. Rev. E 53:5382",
    experiments=("drop",),
    levers=("drop_height_mm", "particle_diameter_mm"),
    strength=Strength("dissipation time", "s", 2e-6, 4e-5, log=True),
    apply=apply,
    law=("restitution", ("speed",)),
)
