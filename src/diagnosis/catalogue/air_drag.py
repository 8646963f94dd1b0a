"""Drag of the air on a grain that falls."""

from typing import Any

from diagnosis.catalogue import Mechanism, Strength, set_law

AIR = {"air_density_kg_m3": 1.2, "air_viscosity_Pa_s": 1.8e-5}


def apply(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Schiller-Naumann drag of a gas `strength` times as dense and viscous as air."""
    gas = {key: value * max(strength, 1e-6) for key, value in AIR.items()}
    return set_law(spec, "drag", "schiller_naumann", **gas)


MECHANISM = Mechanism(
    name="air_drag",
    description="air slows small grains in long drops, which looks like a restitution that "
    "falls with speed",
    source="Schiller, Naumann (1933), Zeitschrift des VDI 77:318",
    experiments=("drop",),
    strength=Strength("drag over that of air", "1", 0.0, 2.0),
    apply=apply,
    law=("drag", ("speed", "size")),
)
