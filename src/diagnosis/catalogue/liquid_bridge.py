"""Capillary bridges between wet grains."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, coarse, set_law

VOLUME_FRACTION = 0.005


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Bridges of a fixed volume; the strength is the surface tension times the wetting.

    Coarse grains get more of it, so that the tensile stress is kept. The plate of the drop test is
    wet too: there a wet grain is told from a dry one (Gollwitzer, Rehberg, Kruelle, Huang (2012),
    Phys. Rev. E 86:011303). The funnel and the shear cell stay dry, since grains that stick to a
    funnel do not leave it.
    """
    wet_plate = {"wall_liquid_volume_fraction": VOLUME_FRACTION}
    return set_law(
        spec,
        "cohesion",
        "liquid_bridge",
        surface_tension_N_m=max(strength * coarse(spec), 1e-9),
        liquid_volume_fraction=VOLUME_FRACTION,
        **(wet_plate if spec["experiment"] == "drop" else {}),
    )


MECHANISM = Mechanism(
    name="liquid_bridge",
    description="water bridges hold grains together and slow their rebound; small grains stand "
    "steeper, bounce lower",
    source="Willett, Adams, Johnson, Seville (2000), Langmuir 16:9396",
    experiments=("shear", "heap", "drop"),
    levers=("normal_stress_kPa", "particle_diameter_mm", "drop_height_mm"),
    strength=Strength("surface tension", "N/m", 0.0, 0.073),
    apply=apply,
    law=("attraction", ("size",)),
)
