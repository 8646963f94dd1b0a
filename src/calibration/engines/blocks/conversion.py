"""What the search for the calibrated angle in other codes found, as numbers and sentences for the
exports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from calibration.engines.blocks.rolling import (
    DAMPING_RATIO,
    ELASTIC_PLASTIC,
    NO_ROTATION,
    STIFFNESS_FACTOR,
    needs_search,
)
from calibration.statistics.numbers import fixed
from dem.contact.catalogue import LAWS, SLOTS
from dem.contact.export import Export

if TYPE_CHECKING:
    from calibration.engines.blocks.material import Granulate
    from dem.contact.export import Pair
    from dem.spec import RunSpec


STAND_IN = ("normal", "damping", "tangential", "friction", "rolling")
"""Slots of which every code has a law: where it lacks the calibrated one, another stands in."""
ROTATION = ("rolling", "torsion")


@dataclass(frozen=True)
class Equivalent:
    """Numbers of grain on grain that give the calibrated angle, in the elastic-plastic law or
    without rotation."""

    rotates: bool
    rolling_friction: float
    static_friction: float
    stiffness_factor: float
    damping_ratio: float


class Conversion:
    """What rolling.json says, as the exports need it."""

    def __init__(self, spec: RunSpec, found: Mapping[str, Any] | None = None) -> None:
        """spec: calibrated `RunSpec`; found: content of rolling.json, or None before the search."""
        self.spec = spec
        self.found = found if found and found["path"] else None

    @property
    def equivalent(self) -> Equivalent:
        """`Equivalent`: the calibrated numbers before the search, and where none is needed."""
        if self.found:
            f = self.found
            return Equivalent(
                f["path"] != NO_ROTATION,
                f["rolling_friction"],
                f["static_friction"],
                f["stiffness_factor"],
                f["damping_ratio"],
            )
        q, pair = self.spec.law_parameters, self.spec.contacts.particle_particle
        factor, damping = q.rolling_stiffness_factor, q.rolling_damping_ratio  # type: ignore[attr-defined]  # a field for each law
        return Equivalent(
            True,
            pair.rolling_friction,
            pair.static_friction,
            STIFFNESS_FACTOR if factor is None else factor,
            DAMPING_RATIO if damping is None else damping,
        )

    def export(self, slot: str, code: str) -> Export:
        """`Export` of the law that `code` has for the calibrated one of a slot: the same law, in
        the slots of STAND_IN otherwise the first that the code has, or an empty one."""
        own = LAWS[slot][getattr(self.spec.laws, slot)]
        others = LAWS[slot].values() if slot in STAND_IN else ()
        return next((x.exports[code] for x in (own, *others) if code in x.exports), Export())

    def exports(self, code: str) -> dict[str, Export]:
        """{slot: `Export`} of what a file for `code` states; without rolling where grains do not
        turn."""
        turning = self.equivalent.rotates
        slots = [s for s in SLOTS if turning or s not in ROTATION]
        return {slot: self.export(slot, code) for slot in slots}

    def pairs(self, material: Granulate) -> tuple[Pair, ...]:
        """The two `Pair`s of a `Granulate`, with the numbers that give the calibrated angle in the
        laws of other codes."""
        e = self.equivalent
        both = {"rolling_stiffness": e.stiffness_factor, "rolling_damping": e.damping_ratio}
        grains = {"static_friction": e.static_friction, "rolling_friction": e.rolling_friction}
        wall = {"rolling_friction": material.grain_wall.contact.rolling_friction}  # type: ignore[attr-defined]
        if not self.rolls:
            both["rolling_friction"] = 0.0
        return tuple(
            replace(pair, contact=replace(pair.contact, **changes | both))  # type: ignore[type-var]
            for pair, changes in ((material.grain_grain, grains), (material.grain_wall, wall))
        )

    @property
    def rolls(self) -> bool:
        """Whether grains turn and their rolling is resisted: rolling friction is then the number
        that a code's other law asks for."""
        e, on_wall = self.equivalent, self.spec.contacts.particle_wall.rolling_friction
        resisted = max(e.rolling_friction, on_wall) > 0.0
        return e.rotates and self.spec.laws.rolling != "none" and resisted  # type: ignore[attr-defined]  # a field for each law

    def sentences(self, name: str) -> list[str]:
        """What was done about rolling friction, for the head of a file; `name`: the law in that
        code's words."""
        if self.found is None:
            return [self._without_search(name)]
        f, pair = self.found, self.spec.contacts.particle_particle
        unit, (low, high) = f["unit"], f["ranges"][ELASTIC_PLASTIC]
        same = f["with_the_same_number"]
        same = "no heap with an angle" if same is None else f"{same:.1f} {unit}"
        out = [
            f"Rolling friction: calibrated as {f['law']} with mu_r = {pair.rolling_friction:.4g}. "
            f"{name} is another "
            f"law, on the relative spin; there the same number gives {same}."
        ]
        if f["path"] == NO_ROTATION:
            out.append(
                f"With more rolling friction that law comes to {low:.1f} to {high:.1f} {unit}, "
                f"which is short of the "
                "calibrated angle. So THE GRAINS DO NOT TURN here, and static friction of grain on "
                "grain is "
                f"{f['static_friction']:.4g} in place of {pair.static_friction:.4g}: this gives "
                f"the angle. It is a "
                "stand-in for heaps, not for what hangs on the grains' spin."
            )
        elif f["reached"]:
            out.append(
                f"mu_r = {f['rolling_friction']:.4g} below comes from runs of this engine's "
                f"elastic_plastic along "
                "rising mu_r."
            )
        else:
            out.append(
                f"THE CALIBRATED ANGLE IS OUT OF REACH: that law came to {low:.1f} to {high:.1f} "
                f"{unit} along rising "
                f"mu_r; the nearest, mu_r = {f['rolling_friction']:.4g}, is taken. Calibrating in "
                f"this law (run: "
                "{laws: {rolling: elastic_plastic}}) tells whether other parameters can make up "
                "for it."
            )
        if f["without_value"]:
            out.append(
                f"{f['without_value']} of {f['runs']} runs of this search gave no angle, as their "
                "funnels clogged or their grains never came to rest; they are left out."
            )
        if first := f.get("searched"):
            wanted = "static_friction" if f["path"] == NO_ROTATION else "rolling_friction"
            number = "rolling friction" if self.rolls else "static friction of grain on grain"
            out.append(f"The search gave {number} of {first[wanted]:.4g} first.")
            out += _checks(first, unit)
            out.append(
                "The number is moved along the path by what is missed at the study's own grains, "
                "and the one below is checked there by further runs."
            )
        return out + _checks(f, unit)

    @property
    def checked(self) -> str:
        """What this engine's heaps give with the numbers of the search, on the scale of the study
        where that was tried; empty without a search, or without such heaps."""
        f = self.found or {}
        told = [_compared(f[scale], f["unit"]) for scale in SCALES if scale in f]
        return told[-1] if told else ""

    def _without_search(self, name):
        laws = self.spec.laws
        rolls = laws.rolling != "none" and self.spec.contacts.particle_particle.rolling_friction > 0
        if not rolls or laws.rolling == ELASTIC_PLASTIC:
            what = "is the law calibrated with" if rolls else "is off"
            return f"Rolling friction: {name} {what}; the number is used as it is."
        not_converted = (
            f"NOT CONVERTED: rolling friction was calibrated as {laws.rolling}, {name} is another "
            f"law, and the number "
            "below is the calibrated one."
        )
        if needs_search(self.spec):
            return (
                f"{not_converted} The heap is flatter with it. `calibration run STUDY "
                "export_converted` searches what gives the calibrated angle in this code and "
                "writes exports/converted/; it makes some fifty heaps."
            )
        return f"{not_converted} Without a heap there is no angle to keep."


SCALES = {"coarse": "on the scale of the search", "full": "on the scale of the study"}


def _checks(found, unit):
    """A sentence for each scale at which numbers were checked."""
    told = {where: _compared(found[s], unit) for s, where in SCALES.items() if s in found}
    return [f"Check {where}: {text}." for where, text in told.items()]


def _compared(a, unit):
    low, high = a["difference_interval_95"]
    return (
        f"{a['mean']:.2f} {unit} ({a['runs']} runs, sd {a['sd']:.2f}) against "
        f"{a['calibrated_law_mean']:.2f} ({a['calibrated_law_runs']} runs, sd "
        f"{a['calibrated_law_sd']:.2f}) with the calibrated law; difference "
        f"{fixed(a['difference'], 2, '+')}, 95 % {fixed(low, 2, '+')} to {fixed(high, 2, '+')}"
    )
