"""A load above the shear plane that the stated normal stress leaves out."""

from collections.abc import Mapping
from typing import Any

from diagnosis.catalogue import Mechanism, Strength


def observe(value: Any, condition: Mapping[str, float], strength: float) -> Any:
    """Shear stress [kPa] as read under `strength` kPa more than stated, of a yield locus through
    the origin."""
    stated = condition["normal_stress_kPa"]
    return value * (stated + strength) / stated


MECHANISM = Mechanism(
    name="uncounted_load",
    description="weight of lid, ring and grains above the shear plane is missing in the "
    "normal stress; it looks like cohesion, but shows in the shear test alone",
    source="ASTM D6128 counts the weight of everything above the shear plane into the normal "
    "stress",
    experiments=("shear",),
    strength=Strength("load not counted", "kPa", 0.0, 0.3),
    observe=observe,
    law=("load", ()),
)
