"""Whether other codes need another number for rolling friction than the calibrated one, and the law
that they have instead."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dem.contact.catalogue import LAWS

if TYPE_CHECKING:
    from dem.spec import RunSpec


ELASTIC_PLASTIC, NO_ROTATION = "elastic_plastic", "no_rotation"
_OWN = {p.key: p.default for p in LAWS["rolling"]["elastic_plastic"].parameters}
STIFFNESS_FACTOR = _OWN["rolling_stiffness_factor"]
DAMPING_RATIO = _OWN["rolling_damping_ratio"]


def needs_search(spec: RunSpec) -> bool:
    """Whether other codes need other numbers than the calibrated ones of a `RunSpec`. They do not
    if theirs is the law of the calibration, if grains roll freely, or if no heap was calibrated:
    there is no angle to keep then."""
    free = spec.laws.rolling == "none" or spec.contacts.particle_particle.rolling_friction == 0.0  # type: ignore[attr-defined]  # a field for each law
    return not free and spec.experiment == "heap" and spec.laws.rolling != ELASTIC_PLASTIC  # type: ignore[attr-defined]  # a field for each law
