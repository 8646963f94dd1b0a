"""Adhesion of grains to the wall."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, set_law


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """JKR between grain and wall; grains do not attract each other."""
    return set_law(spec, "cohesion", "jkr", wall_surface_energy_J_m2=strength)


MECHANISM = Mechanism(
    name="wall_adhesion",
    description="grains stick to the plate; small ones slide later by the inverse square of their "
    "diameter",
    source="Johnson, Kendall, Roberts (1971), Proc. R. Soc. A 324:301",
    experiments=("tilt", "drop"),
    levers=("particle_diameter_mm", "drop_height_mm"),
    strength=Strength("wall surface energy", "J/m2", 0.0, 2e-4),
    apply=apply,
    law=("attraction", ("size",)),
)
