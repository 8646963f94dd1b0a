"""Friction that falls with the load: mu = mu0 (F / F0)^-n."""

from diagnosis.catalogue import Mechanism, Strength, setting

HEAVY = 5e-5  # N, about the weight of a 2 mm grain of salt

MECHANISM = Mechanism(
    name="stress_dependent_friction",
    description="friction falls as a power of the load; the yield locus is curved and small "
    "grains slide later",
    source="Archard (1957), Proc. R. Soc. A 243:190",
    experiments=("tilt", "shear"),
    strength=Strength("exponent", "1", 0.0, 1 / 3),
    apply=setting(
        "friction", "stress_dependent", "friction_exponent", friction_reference_force_N=HEAVY
    ),
    law=("friction", ("size",)),
)
