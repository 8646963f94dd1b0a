"""Materials, laws and contact parameters of a run spec, in SI units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dem.contact.law import Grain
from dem.contact.registry import ContactParameters, Laws, Material
from dem.grains.sizes import mean_radius

if TYPE_CHECKING:
    from dem.spec import RunSpec


PARTICLE, WALL = "particle", "wall"


def laws_of(spec: RunSpec) -> Laws:
    """`Laws` of a `RunSpec`."""
    return Laws(**spec.laws.model_dump())


def material_of(entry: Any) -> Material:
    """`Material` from a spec's material."""
    return Material(entry.density_kg_m3, entry.shear_modulus_Pa, entry.poisson_ratio)


def contact_parameters(spec: RunSpec) -> dict[tuple[str, str], ContactParameters]:
    """{pair of materials: ContactParameters}; what a law needs is given for grain on grain and
    grain on wall."""
    given, chosen = spec.law_parameters, laws_of(spec).chosen()
    grain = Grain(material_of(spec.materials.particle), mean_radius(spec))
    out = {}
    for other, contact in (
        (PARTICLE, spec.contacts.particle_particle),
        (WALL, spec.contacts.particle_wall),
    ):
        constants = {}
        for p in (p for one in chosen for p in one.parameters):
            value = getattr(given, f"wall_{p.key}" if p.wall and other == WALL else p.key)
            value = p.default if value is None else value
            constants[p.name] = p.unset if value is None else p.to_si(value, grain)
        out[PARTICLE, other] = ContactParameters(
            contact.restitution, contact.static_friction, contact.rolling_friction, **constants
        )
    return out
