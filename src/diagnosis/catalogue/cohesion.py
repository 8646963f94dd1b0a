"""Cohesion between grains: JKR adhesion with one surface energy."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, coarse, set_law


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """JKR between grains; the walls do not attract. Coarse grains get more, so that the tensile
    stress is kept."""
    return set_law(spec, "cohesion", "jkr", surface_energy_J_m2=strength * coarse(spec))


MECHANISM = Mechanism(
    name="cohesion",
    description="grains attract each other; the yield locus gains an intercept and small "
    "grains stand steeper",
    source="Johnson, Kendall, Roberts (1971), Proc. R. Soc. A 324:301",
    experiments=("shear", "heap"),
    strength=Strength("surface energy", "J/m2", 0.0, 0.12),
    apply=apply,
    law=("attraction", ()),
)
