"""Grains that stick to the plate and not to each other."""

from diagnosis.catalogue import Mechanism, Strength, setting

MECHANISM = Mechanism(
    name="wall_adhesion",
    description="grains stick to the plate; small ones slide later by the inverse square of "
    "their diameter",
    source="Johnson, Kendall, Roberts (1971), Proc. R. Soc. A 324:301",
    experiments=("tilt", "drop"),
    strength=Strength("wall surface energy", "J/m2", 0.0, 2e-4),
    apply=setting("cohesion", "jkr", "wall_surface_energy_J_m2"),
    law=("attraction", ("size",)),
)
