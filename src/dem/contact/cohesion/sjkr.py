"""Simplified JKR: an attraction in proportion to the contact area, F = k A, A = pi R* overlap.

k is the cohesion energy density [J/m3]. The attraction ends where the spheres part.
"""

from math import pi

from dem.contact.export import Export
from dem.contact.law import Law, Parameter
from dem.kernel.arithmetic import law, maximum

LIGGGHTS_AREA, LIGGGHTS_WALL_AREA = 4.0, 2.0
"""Contact area of its sjkr2 over that here, of two grains and at a wall."""


@law
def attraction(p, overlap, r_eff, grain):
    """Attractive force [N]."""
    return p.cohesion * pi * r_eff * maximum(overlap, 0.0)


LAW = Law(
    slot="cohesion",
    name="sjkr",
    equation="k π R* δ: k times the area of a Hertz contact",
    source="form F = k A of the LIGGGHTS manual, with another A",
    kernels={"attraction": attraction},
    parameters=(
        Parameter(
            key="cohesion_energy_density_J_m3",
            name="cohesion_energy_density",
            meaning="cohesion energy density k",
            limits={"ge": 0},
            wall=True,
        ),
    ),
    constants=("cohesion",),
    values=lambda contact: {"cohesion": contact.cohesion_energy_density},
    exports={
        "liggghts": Export(
            words="cohesion sjkr2",
            numbers=lambda pair: {
                "cohesionEnergyDensity": pair.contact.cohesion_energy_density
                / (LIGGGHTS_WALL_AREA if pair.wall else LIGGGHTS_AREA)
            },
        )
    },
    left_out="NOT CONVERTED: cohesion sjkr; these grains do not stick.",
)
