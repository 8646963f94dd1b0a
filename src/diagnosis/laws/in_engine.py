"""A free law as the law that the engine has in its slot: a curve through a few states
(`dem.contact.curve`)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dem.contact.curve import POINTS
from diagnosis.catalogue import set_law
from diagnosis.laws.known import with_coefficient
from diagnosis.laws.slots import FAMILY, FreeLaw
from diagnosis.measurements import CONTACTS
from diagnosis.page.words import place

DIGITS = 9  # decimals of what is written into a run spec


@dataclass(frozen=True)
class Curve:
    """A curve of the engine: slot and name of its law, the beginning of its keys; the coefficient
    of the contact that it multiplies, and the states that it can depend on."""

    slot: str
    law: str
    coefficient: str
    states: tuple


CURVES = {
    "restitution": Curve("damping", "restitution_curve", "restitution", ("speed", "size")),
    "friction": Curve("friction", "friction_curve", "static_friction", ("load", "speed", "size")),
}
"""Slot of a free law -> the curve of the engine in it."""


def curve_of(law: FreeLaw) -> Curve | None:
    """`Curve` that is a law with experiment, slot and state; None where the engine has none.

    The rate of a tilt is no speed of sliding, and the load of a shear cell is not that of a
    contact."""
    known = CURVES.get(law.slot)
    if law.experiment not in CONTACTS or known is None or not law.state:
        return None
    return known if set(law.state) <= set(known.states) else None


def not_run(law: Mapping[str, Any]) -> str:
    """Why the engine has no run with a law {experiment, slot, state, ...} of verdict.json."""
    own = (f for f in FAMILY if f.experiment == law["experiment"])
    found = [f for f in own if (f.slot, f.state) == (law["slot"], tuple(law["state"]))]
    words = place(law)
    told = "what is said of left-out levels is computed from the curve, and no runs were made"
    if any(curve_of(f) for f in found):
        return f"The engine has a law for {words}, but not beside the study's other laws: {told}."
    return f"The engine has no law for {words}: {told}."


def parameters(
    law: FreeLaw, values: Sequence[Mapping[str, float]]
) -> tuple[float, dict[str, float]]:
    """(coefficient in the middle, {key: value} of `law_parameters`) of a free law.

    values: [{state, value, ...}] at equal steps of the state's logarithm, as `found.curve` has
    them; the engine takes every few of them."""
    known = curve_of(law)
    places = np.linspace(0, len(values) - 1, POINTS).round().astype(int)
    state = [values[i]["state"] for i in places]
    value = [values[i]["value"] for i in places]
    middle = value[POINTS // 2]
    shares = {
        f"wall_{known.law}_{k}": round(v / middle, DIGITS)  # type: ignore[union-attr]
        for k, v in enumerate(value, start=1)
    }
    reach = {f"{known.law}_low": state[0], f"{known.law}_ratio": state[-1] / state[0]}  # type: ignore[union-attr]
    powers = {f"{known.law}_{s}_power": float(s in law.state) for s in known.states}  # type: ignore[union-attr]
    return middle, shares | reach | powers


def switched_on(
    law: FreeLaw, values: Sequence[Mapping[str, float]]
) -> tuple[Callable[[dict[str, Any], float], dict[str, Any]], float]:
    """A function of a run spec (a mapping) and a coefficient that gives the spec with the free law
    switched on, the coefficient that in the middle of its states; and this coefficient as the
    values have it."""
    known = curve_of(law)
    middle, found = parameters(law, values)

    def switch(spec, coefficient):
        spec = set_law(spec, known.slot, known.law, **found)
        return with_coefficient(spec, known.coefficient, coefficient)

    return switch, middle


def keys(law: FreeLaw, values: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """The keys of a run spec that switch a free law on: {laws, law_parameters, contacts}."""
    switch, middle = switched_on(law, values)
    return switch({}, middle)
