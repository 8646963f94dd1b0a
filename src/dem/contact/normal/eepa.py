"""Edinburgh elasto-plastic adhesive contact: what was pressed together sticks, the more the harder
it was pressed.

With n = 3/2 and the deepest overlap d so far, in three branches:
    loading             k1 x^n
    unloading, reload   k2 (x^n - x_p^n),  x_p = (1 - k1/k2)^(1/n) d the plastic overlap
    parting             -k_adh x^n, once the second branch pulls by f_min = (3/2) pi g a_p
k1 = (4/3) E* sqrt(R*); plasticity ratio lambda = 1 - k1/k2; g adhesion energy of the contact
[J/m2]; a_p = sqrt(R* x_p) the contact radius at the plastic overlap, so that the pull grows with
the load there was. The second and the third branch meet where x^n = x_p^n - f_min/k2, which fixes
k_adh; f_min is at most k2 x_p^n/2. Sliding friction is limited by mu (F + k_adh x^n), so that what
sticks also holds sideways.

Morrissey (2013), thesis, University of Edinburgh; Thakur, Morrissey, Sun, Chen, Ooi (2014),
Granular Matter 16:383. Here the exponents of loading and of adhesion are both 3/2 and the constant
pull-off force is 0; a reload in the third branch goes back along it, where the published law goes
up in parallel to the second. Other codes may take another radius for the patch.
"""

import math

from dem.contact.law import Law, Parameter
from dem.kernel.arithmetic import TINY, law, maximum, minimum, sqrt


@law
def normal(p, overlap, r_eff, deepest):
    """Force, stiffness, contact radius, deepest overlap and the adhesion of the third branch."""
    pressed = maximum(overlap, 0.0)
    k1 = (4.0 / 3.0) * p.young * sqrt(r_eff)
    k2 = k1 / (1.0 - p.plasticity)
    deepest = maximum(deepest, pressed)
    x, most = pressed * sqrt(pressed), deepest * sqrt(deepest)
    rest = p.plasticity * most
    # x_p^n = rest, so a_p = sqrt(R*) rest^(1/3); the cube root from the deepest overlap:
    # (lambda^(1/3)) sqrt(deepest)
    patch = sqrt(r_eff * deepest) * p.plasticity_root
    pull = minimum(1.5 * math.pi * p.adhesion_energy * patch, 0.5 * k2 * rest)
    parting = rest - pull / k2
    adhesion = pull / maximum(parting, TINY) * x
    elastic = k2 * (x - rest)
    force = maximum(elastic, -adhesion)
    radius = sqrt(r_eff * pressed)
    return force, 2.0 * p.young * radius, radius, deepest, adhesion


LAW = Law(
    slot="normal",
    name="eepa",
    equation="max(k₂(δ^1.5 − λ δ_max^1.5), −k_adh δ^1.5), loading k₁ δ^1.5, λ = 1 − k₁/k₂",
    source="Morrissey (2013); Thakur et al. (2014)",
    kernels={"normal": normal},
    parameters=(
        Parameter(
            key="plasticity_ratio",
            name="plasticity",
            meaning="1 - k1/k2 of loading and unloading stiffness",
            limits={"ge": 0, "lt": 1},
            default=0.5,
        ),
        Parameter(
            key="adhesion_energy_J_m2",
            name="adhesion_energy",
            meaning="surface adhesion energy of the contact",
            limits={"ge": 0},
            wall=True,
        ),
    ),
    constants=("plasticity", "plasticity_root", "adhesion_energy"),
    values=lambda contact: {"plasticity_root": contact.plasticity ** (1.0 / 3.0)},
    only_with={
        "damping": ("none",),
        "tangential": ("mindlin",),
        "cohesion": ("none", "liquid_bridge"),
    },
    longest_step=lambda contact, mass, rayleigh: math.sqrt(1.0 - contact.plasticity) * rayleigh,
    left_out="NOT CONVERTED: normal eepa; the exported contact is elastic with a dashpot and does "
    "not stick.",
)
