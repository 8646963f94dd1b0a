"""Friction that falls with the load on a contact."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, set_law

REFERENCE_FORCE_N = 5e-5


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """mu = mu0 (F / F0)^-n; F0 is about the weight of a 2 mm grain of salt."""
    return set_law(
        spec,
        "friction",
        "stress_dependent",
        friction_exponent=strength,
        friction_reference_force_N=REFERENCE_FORCE_N,
    )


MECHANISM = Mechanism(
    name="stress_dependent_friction",
    description="friction falls as a power of the load; the yield locus is curved and small grains "
    "slide later",
    source="Archard (1957), Proc. R. Soc. A 243:190",
    experiments=("tilt", "shear"),
    levers=("particle_diameter_mm", "normal_stress_kPa"),
    strength=Strength("exponent", "1", 0.0, 1 / 3),
    apply=apply,
    law=("friction", ("size",)),
)
