"""Walton and Braun's hysteretic linear spring: restitution e whatever the speed, without a dashpot.

Loading F = k overlap; unloading and reloading F = k/e^2 (overlap - rest), with the rest overlap (1
- e^2) times the deepest so far; no tension. The energy of loading is k d^2/2 and e^2 of it comes
back, so that e = sqrt(k/k_unload). Walton, Braun (1986), Journal of Rheology 30:949.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dem.contact.law import Law
from dem.contact.normal.linear import BESIDE, STIFFNESS, step_of
from dem.kernel.arithmetic import law, maximum, minimum, sqrt

if TYPE_CHECKING:
    from dem.contact.registry import ContactParameters


@law
def normal(p, overlap, r_eff, deepest):
    """Force, stiffness of loading, contact radius, deepest overlap and no adhesion."""
    pressed = maximum(overlap, 0.0)
    deepest = maximum(deepest, pressed)
    loading = p.normal_stiffness * pressed
    unloading = p.normal_unloading * pressed - (p.normal_unloading - p.normal_stiffness) * deepest
    force = maximum(minimum(loading, unloading), 0.0)
    return force, p.normal_stiffness + 0.0 * r_eff, sqrt(r_eff * pressed), deepest, 0.0 * r_eff


def unloading_stiffness(contact: ContactParameters) -> float:
    """k/e^2 [N/m]."""
    return contact.normal_stiffness / contact.restitution**2  # type: ignore[attr-defined]


LAW = Law(
    slot="normal",
    name="walton_braun",
    equation="F = k δ; unloading (k/e²)(δ − (1 − e²) δ_max), not below 0",
    source="Walton, Braun (1986)",
    kernels={"normal": normal},
    parameters=(STIFFNESS,),
    constants=("normal_stiffness", "normal_unloading"),
    values=lambda contact: {"normal_unloading": unloading_stiffness(contact)},
    only_with={"damping": ("none",)} | BESIDE,
    longest_step=lambda contact, mass, rayleigh: step_of(unloading_stiffness(contact), mass),
    left_out="NOT CONVERTED: normal walton_braun; the exported spring is that of Hertz, with a "
    "dashpot for the same e.",
)
