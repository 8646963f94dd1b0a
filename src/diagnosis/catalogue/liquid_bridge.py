"""Capillary bridges between wet grains."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, coarse, set_law

BRIDGE = 0.005  # volume of a liquid bridge over that of a grain


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Bridges of a fixed volume; the strength is the surface tension times the wetting.

    Coarse grains get more of it, so that the tensile stress is kept. The plate of the drop test is
    wet too: there a wet grain is told from a dry one (Gollwitzer, Rehberg, Kruelle, Huang (2012),
    Phys. Rev. E 86:011303). The funnel and the shear cell stay dry, since grains that stick to a
    funnel do not leave it.
    """
    wet_plate = {"wall_liquid_volume_fraction": BRIDGE} if spec["experiment"] == "drop" else {}
    tension = max(strength * coarse(spec), 1e-9)
    wet = {"surface_tension_N_m": tension, "liquid_volume_fraction": BRIDGE}
    return set_law(spec, "cohesion", "liquid_bridge", **wet, **wet_plate)


MECHANISM = Mechanism(
    name="liquid_bridge",
    description="water bridges hold grains together and slow their rebound; small grains "
    "stand steeper, bounce lower",
    source="Willett, Adams, Johnson, Seville (2000), Langmuir 16:9396",
    experiments=("shear", "heap", "drop"),
    strength=Strength("surface tension", "N/m", 0.0, 0.073),
    apply=apply,
    law=("attraction", ("size",)),
)
