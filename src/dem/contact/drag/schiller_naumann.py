"""Drag of still air on single spheres, worked out in `dem.kernel.drag`."""

from dem.contact.law import Law, Parameter

LAW = Law(
    slot="drag",
    name="schiller_naumann",
    equation="−3πμdv max(1 + 0.15 Re^0.687, 0.44 Re / 24)",
    source="Schiller, Naumann (1933); Newton's range above Re = 1000",
    parameters=(
        Parameter("air_density_kg_m3", "air_density", "density of the air", {"gt": 0}, 1.2),
        Parameter(
            key="air_viscosity_Pa_s",
            name="air_viscosity",
            meaning="dynamic viscosity of the air",
            limits={"gt": 0},
            default=1.8e-5,
        ),
    ),
    left_out="NOT CONVERTED: drag schiller_naumann; these grains fall in a vacuum.",
)
