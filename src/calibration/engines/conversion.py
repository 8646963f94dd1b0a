"""The calibrated point as another code needs it: two materials and two kinds of contact in
effective constants, the numbers that give the calibrated angle in the laws of other codes, and
sentences on what is converted and what is not."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from calibration.engines.templates import words
from dem.constants import GRAVITY
from dem.contact.catalogue import LAWS, SLOTS
from dem.contact.export import Export, Pair
from dem.contact.registry import Laws, pair_properties
from dem.experiments.setup import time_step_of
from dem.grains.sizes import mean_radius
from dem.materials import PARTICLE, WALL, contact_parameters, laws_of, material_of
from dem.spec import RunSpec

TYPICAL_LOAD = 10.0
"""Normal force of a typical contact in a heap, in grain weights: the pressure half-way down, rho g
h/2, on d^2 is h/(2d) = 10 weights for a heap that is twenty grains high. Only stiffnesses of
rolling springs that a code takes as constants depend on it."""
WIDTH = 110
"""Of the comment at the head of a file."""
STAND_IN = ("normal", "damping", "tangential", "friction", "rolling")
"""Slots of which every code has a law: where it lacks the calibrated one, another stands in."""
ROTATION = ("rolling", "torsion")
ELASTIC_PLASTIC, NO_ROTATION = "elastic_plastic", "no_rotation"
"""Paths of the search for the calibrated angle in laws that other codes have."""
_OWN = {p.key: p.default for p in LAWS["rolling"][ELASTIC_PLASTIC].parameters}
STIFFNESS_FACTOR = _OWN["rolling_stiffness_factor"]
DAMPING_RATIO = _OWN["rolling_damping_ratio"]


class Granulate:
    """Grains and walls of a `RunSpec` at the calibrated point. The mean grain stands for all where
    there is a size distribution."""

    def __init__(self, spec: RunSpec) -> None:
        m = spec.materials
        self.spec, self.radius, self.time_step = spec, mean_radius(spec), time_step_of(spec)
        self.grain, self.wall = material_of(m.particle), material_of(m.wall)
        self.grain_grain = self._pair(self.grain, PARTICLE, 0.5)
        self.grain_wall = self._pair(self.wall, WALL, 1.0)

    def _pair(self, other, name, share):
        """`Pair` of a grain and another body; share: of its radius and inertia that counts."""
        radius, density = self.radius, self.grain.density
        inertia = 1.4 * 4 / 3 * math.pi * radius**5 * density
        load = TYPICAL_LOAD * 4 / 3 * math.pi * radius**3 * density * GRAVITY
        contact = contact_parameters(self.spec)[PARTICLE, name]
        p = pair_properties(Laws(), self.grain, other, contact)
        reduced = share * radius, share * inertia
        return Pair(p.young, p.shear, p.damping, *reduced, load, name == WALL, contact)


def needs_search(spec: RunSpec) -> bool:
    """Return whether other codes need other numbers than the calibrated ones of a `RunSpec`. They
    do not if theirs is the law of the calibration, if grains roll freely, or if no heap was
    calibrated: there is no angle to keep then."""
    free = spec.laws.rolling == "none" or spec.contacts.particle_particle.rolling_friction == 0.0  # type: ignore[attr-defined]  # a field for each law
    return not free and spec.experiment == "heap" and spec.laws.rolling != ELASTIC_PLASTIC  # type: ignore[attr-defined]  # a field for each law


class Conversion:
    """What rolling.json says, as the exports need it."""

    def __init__(self, spec: RunSpec, found: Mapping[str, Any] | None = None) -> None:
        """spec: calibrated `RunSpec`; found: content of rolling.json, or None before the search."""
        self.spec = spec
        self.found = found if found and found["path"] else None

    @property
    def turns(self) -> bool:
        """Return whether grains turn: the search may find the angle without rotation alone."""
        return not self.found or self.found["path"] != NO_ROTATION

    @property
    def numbers(self) -> Mapping[str, float]:
        """Numbers of grain on grain that give the calibrated angle, in the elastic-plastic law or
        without rotation: the calibrated ones before the search, and where none is needed."""
        if self.found:
            return self.found
        q, pair = self.spec.law_parameters, self.spec.contacts.particle_particle
        factor, damping = q.rolling_stiffness_factor, q.rolling_damping_ratio  # type: ignore[attr-defined]  # a field for each law
        return {
            "rolling_friction": pair.rolling_friction,
            "static_friction": pair.static_friction,
            "stiffness_factor": STIFFNESS_FACTOR if factor is None else factor,
            "damping_ratio": DAMPING_RATIO if damping is None else damping,
        }

    def export(self, slot: str, code: str) -> Export:
        """`Export` of the law that `code` has for the calibrated one of a slot: the same law, in
        the slots of STAND_IN otherwise the first that the code has, or an empty one."""
        own = LAWS[slot][getattr(self.spec.laws, slot)]
        others = LAWS[slot].values() if slot in STAND_IN else ()
        return next((x.exports[code] for x in (own, *others) if code in x.exports), Export())

    def exports(self, code: str) -> dict[str, Export]:
        """{slot: `Export`} of what a file for `code` states; without rolling where grains do not
        turn."""
        slots = [s for s in SLOTS if self.turns or s not in ROTATION]
        return {slot: self.export(slot, code) for slot in slots}

    def pairs(self, material: Granulate) -> tuple[Pair, ...]:
        """The two `Pair`s of a `Granulate`, with the numbers that give the calibrated angle in the
        laws of other codes."""
        of = self.numbers
        both = {"rolling_stiffness": of["stiffness_factor"], "rolling_damping": of["damping_ratio"]}
        grains = {name: of[name] for name in ("static_friction", "rolling_friction")}
        wall = {"rolling_friction": material.grain_wall.contact.rolling_friction}  # type: ignore[attr-defined]
        if not self.rolls:
            both["rolling_friction"] = 0.0
        return tuple(
            replace(pair, contact=replace(pair.contact, **changes | both))  # type: ignore[type-var]
            for pair, changes in ((material.grain_grain, grains), (material.grain_wall, wall))
        )

    @property
    def rolls(self) -> bool:
        """Return whether grains turn and their rolling is resisted: rolling friction is then the
        number that a code's other law asks for."""
        on_wall = self.spec.contacts.particle_wall.rolling_friction
        resisted = max(self.numbers["rolling_friction"], on_wall) > 0.0
        return self.turns and self.spec.laws.rolling != "none" and resisted  # type: ignore[attr-defined]  # a field for each law

    def sentences(self, name: str) -> list[str]:
        """Return what was done about rolling friction, for the head of a file; `name`: the law in
        that code's words."""
        pair, laws = self.spec.contacts.particle_particle, self.spec.laws
        if self.found:
            text = words("conversion").searched(name, self.found, pair, self.rolls, not self.turns)
        else:
            rolls = laws.rolling != "none" and pair.rolling_friction > 0  # type: ignore[attr-defined]  # a field for each law
            search = needs_search(self.spec)
            text = words("conversion").without_search(
                name, self.spec, rolls, ELASTIC_PLASTIC, search
            )
        return text.splitlines()

    @property
    def checked(self) -> str:
        """Return what this engine's heaps give with the numbers of the search, on the scale of the
        study where that was tried; empty without a search, or without such heaps."""
        f = self.found or {}
        heaps = f.get("full") or f.get("coarse")
        return words("conversion").compared(heaps, f["unit"]) if heaps else ""

    def head(
        self, code: str, material: Granulate, about: Sequence[str], *more: str, mark: str = "#"
    ) -> str:
        """The comment at the head of a file, behind `mark`: how it is used, provenance (lines), how
        rolling friction was converted, what differs in the `code`, and more."""
        title, exports = words("conversion").title(code), self.exports(code).values()
        notes = [note for export in exports for note in export.notes(self.pairs(material)[0])]
        told = [*self.sentences(self.export("rolling", code).called), *notes]
        lines = []
        for text in (title, *about, *told, *dispensed(material.spec, code), *more):
            lines += [f"{mark} {line}" for line in textwrap.wrap(text, WIDTH - len(mark))]
        return "\n".join(lines)


def dispensed(spec: RunSpec, code: str) -> list[str]:
    """Sentences on the laws of the calibrated `RunSpec` that `code` does not have and a heap does
    not need."""
    lost = [law for law in laws_of(spec).chosen() if code not in law.exports]
    return [law.left_out for law in lost if law.dispensable]


def left_out(spec: RunSpec, code: str = "") -> list[str]:
    """Sentences on what the export to a code does not carry over of the calibrated `RunSpec`; any
    code unless given."""
    lost = [law for law in laws_of(spec).chosen() if code not in law.exports]
    out = [law.left_out for law in lost if law.left_out and not law.dispensable]
    clump, long = spec.particles.clump, spec.particles.elongation
    spheres = "these are spheres of the same volume."
    if long != 1.0:
        out.append(f"NOT CONVERTED: grains {long:g} times as long as wide; {spheres}")
    if clump is not None:
        out.append(f"NOT CONVERTED: grains of {len(clump.radius_mm)} bonded spheres; {spheres}")
    if spec.particles.sizes is not None:
        out.append("The mean grain stands for all sizes where a number depends on the size.")
    return out
