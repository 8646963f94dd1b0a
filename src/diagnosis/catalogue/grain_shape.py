"""Grains that are longer than wide, where the model has spheres."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, set_part

LONGEST = 1.6  # longer grains do not pass the funnel that stands in the rig for coarse spheres


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Each grain is two bonded spheres with the volume of the stated one; the strength is length
    over width."""
    return set_part(spec, "particles", elongation=strength)


MECHANISM = Mechanism(
    name="grain_shape",
    description="elongated grains roll less than spheres do; a heap that rolling friction hardly "
    "holds stands steeper",
    source="Wensrich, Katterfeld (2012), Powder Technol. 217:409",
    experiments=("heap",),
    levers=("particle_diameter_mm", "discharge_height_mm"),
    strength=Strength("length over width", "1", 1.0, LONGEST, off=1.0),
    apply=apply,
)
