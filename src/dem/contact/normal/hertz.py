"""Hertz' elastic contact of two spheres: F = (4/3) E* sqrt(R*) overlap^(3/2), S_n = 2 E* sqrt(R*
overlap).

Hertz (1882); Johnson (1985), Contact Mechanics, chapter 4.
"""

from dem.contact.export import Export
from dem.contact.law import Law
from dem.kernel.arithmetic import law, maximum, sqrt


@law
def normal(p, overlap, r_eff, deepest):
    """Elastic force, stiffness, contact radius, deepest overlap (not its business) and no
    adhesion."""
    pressed = maximum(overlap, 0.0)
    radius = sqrt(r_eff * pressed)
    stiffness = 2.0 * p.young * radius
    return (2.0 / 3.0) * stiffness * pressed, stiffness, radius, deepest, 0.0 * r_eff


LAW = Law(
    slot="normal",
    name="hertz",
    equation="F = (4/3) E* √R* δ^1.5, S_n = 2 E* √(R* δ)",
    source="Hertz (1882); Johnson (1985)",
    kernels={"normal": normal},
    # e would be unmet; a stretched spring gives work
    not_with={"damping": ("none",), "tangential": ("linear",)},
    exports={
        "liggghts": Export(words="model hertz"),
        "lammps": Export(
            words="hertz",
            numbers=lambda pair: {"k": 4.0 / 3.0 * pair.young, "e": pair.contact.restitution},
        ),
        "mercurydpm": Export(
            numbers=lambda pair: {
                "EffectiveElasticModulusAndRestitutionCoefficient": (
                    pair.young,
                    pair.contact.restitution,
                )
            }
        ),
    },
    default=True,
)
