"""Drag of still air."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, set_law

DENSITY, VISCOSITY = 1.2, 1.8e-5


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Schiller-Naumann drag of a gas `strength` times as dense and viscous as air."""
    strength = max(strength, 1e-6)
    return set_law(
        spec,
        "drag",
        "schiller_naumann",
        air_density_kg_m3=DENSITY * strength,
        air_viscosity_Pa_s=VISCOSITY * strength,
    )


MECHANISM = Mechanism(
    name="air_drag",
    description="air slows small grains in long drops, which looks like a restitution that falls "
    "with speed",
    source="Schiller, Naumann (1933), Zeitschrift des VDI 77:318",
    experiments=("drop",),
    levers=("drop_height_mm", "particle_diameter_mm"),
    strength=Strength("drag over that of air", "1", 0.0, 2.0),
    apply=apply,
    law=("drag", ("speed", "size")),
)
