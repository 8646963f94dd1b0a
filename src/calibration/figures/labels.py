"""Names and units as a reader sees them."""

from __future__ import annotations

import re
from dataclasses import dataclass

from calibration.statistics.numbers import fixed
from dem.units import behind, unit_of, without_unit

OF_A_PAIR = re.compile(
    r"(?P<one>[^_]+)_(?P<other>[^_]+)_"
    r"(?P<what>restitution|static_friction|rolling_friction|surface_energy|cohesion_energy_density)"
)
POISSON = re.compile(r"((?P<of>[^_]+)_)?poisson_ratio")


def label(name: str) -> str:
    """Readable form of a factor's or another name: `salt_steel_rolling_friction` is "rolling
    friction of salt on steel"."""
    pair, poisson = OF_A_PAIR.fullmatch(name), POISSON.fullmatch(name)
    if pair:
        return f"{pair['what']} of {pair['one']} on {pair['other']}".replace("_", " ")
    if poisson:
        return "Poisson's ratio" + (f" of {poisson['of']}" if poisson["of"] else "")
    return name.replace("_", " ")


PLACES = {
    "contacts.particle_particle": "grain on grain",
    "contacts.particle_wall": "grain on wall",
    "materials.particle": "grain",
    "materials.wall": "wall",
    "particles": "grains",
    "laws": "law",
    "law_parameters": "law's constant",
}
"""Part of a run spec -> what a reader calls it."""


def parameter_words(key: str) -> str:
    """What a key of the run spec is called where a study's own name for it would mislead, as in a
    diagnosis of other grains: 'restitution, grain on wall'."""
    place = next((p for p in PLACES if key.startswith(f"{p}.")), None)
    if place is None:
        return label(without_unit(key))
    name = label(without_unit(key.removeprefix(f"{place}.")))
    return f"{name}, {PLACES[place]}"


@dataclass(frozen=True)
class Response:
    """What a study calibrates, for labels: its name and its unit as written behind a number."""

    name: str
    unit: str

    @property
    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.name}{self.brackets}"

    @property
    def brackets(self) -> str:
        """The unit in brackets, empty where there is none."""
        return f" [{self.unit.strip()}]" if self.unit else ""

    def value(self, x: float) -> str:
        """A value with its unit: two decimals of an angle, else four digits."""
        return f"{fixed(x, 2)}°" if self.unit == "°" else f"{x:.4g}{self.unit}"


NAMES = {
    "arched": "arch over the orifice",
    "beverloo_constant": "Beverloo constant",
    "froude_number": "Froude number",
    "hausner_ratio": "Hausner ratio",
    "hold_up": "most grains in the funnel",
    "in_funnel": "grains left in the funnel",
    "on_plate": "grains on the plate",
    "share_in_funnel": "share left in the funnel",
    "spilled": "grains spilled",
    "steps_per_contact": "time steps in a contact",
    "strain_at_load": "strain under the load",
}
"""Metrics whose own names, written apart, would name no quantity: what people call them."""
SCATTER = "_sd"


def response_of(metric: str) -> Response:
    """`Response` of a run's metric, whose name ends in its unit (angle_of_repose_deg), under the
    name that people give it."""
    bare = without_unit(metric)
    own = bare.removesuffix(SCATTER)
    name = NAMES.get(own, label(without_unit(own)))
    return Response(f"scatter of the {name}" if own != bare else name, behind(unit_of(metric)))


ANGLE = response_of("angle_of_repose_deg")
