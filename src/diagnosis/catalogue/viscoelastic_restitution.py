"""Restitution of viscoelastic contacts, in place of a dashpot with a constant one."""

from diagnosis.catalogue import Mechanism, Strength, setting

MECHANISM = Mechanism(
    name="viscoelastic_restitution",
    description="restitution falls with impact speed, 1 - e growing as its fifth root",
    source="Brilliantov, Spahn, Hertzsch, Poeschel (1996), Phys. Rev. E 53:5382",
    experiments=("drop",),
    strength=Strength("dissipation time", "s", 2e-6, 4e-5, log=True),
    apply=setting("damping", "viscoelastic", "viscoelastic_time_s"),
    law=("restitution", ("speed",)),
)
