"""Capillary bridges between wet grains."""

from calibration.discrepancy.catalogue import Mechanism, Strength, coarse, set_law

VOLUME_FRACTION = 0.005


def apply(spec, strength):
    """Bridges of a fixed volume between grains; the strength is the surface tension times the wetting.

    Coarse grains get more of it, so that the tensile stress is kept.
    """
    return set_law(
        spec,
        "cohesion",
        "liquid_bridge",
        surface_tension_N_m=max(strength * coarse(spec), 1e-9),
        liquid_volume_fraction=VOLUME_FRACTION,
    )


MECHANISM = Mechanism(
    name="liquid_bridge",
    description="water bridges hold grains together over a gap; intercept in proportion to the surface tension",
    source="Willett, Adams, Johnson, Seville (2000), Langmuir 16:9396",
    experiments=("shear", "heap"),
    levers=("normal_stress_kPa", "particle_diameter_mm"),
    strength=Strength("surface tension", "N/m", 0.0, 0.073, 0.04),
    apply=apply,
)
