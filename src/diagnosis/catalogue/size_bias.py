"""The grains are larger or smaller than stated."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, coarse, set_part


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """All diameters multiplied, the number of grains kept."""
    return set_part(spec, "particles", scale_factor=coarse(spec) * strength)


MECHANISM = Mechanism(
    name="size_bias",
    description="the stated diameter is off by a factor; shows where the rig is small against the "
    "grains",
    source="sieving passes grains by their second largest dimension",
    experiments=("heap",),
    levers=("particle_diameter_mm", "discharge_height_mm"),
    strength=Strength("true over stated diameter", "1", 0.75, 1.3, off=1.0),
    apply=apply,
    multiplies="particle_diameter_mm",
)
