"""A free law as the law that the engine has in its slot (a curve through a few states:
`dem.contact.curve`), and the gain of each law and of all together, by the engine's own contacts at
levels that were left out of the fit.

The levels of the lever that a law acts on are left out in turn, and everything is fitted anew
without each. The engine then integrates the contact with the law switched on and off. What the
engine has no law for is taken from the fitted curve.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import Condition
from dem.contact.curve import POINTS
from dem.errors import SpecError
from diagnosis.catalogue import set_law
from diagnosis.extend import gain
from diagnosis.laws.known import (
    COEFFICIENT,
    NO_COEFFICIENT,
    contact_logs,
    observed_log,
    with_coefficient,
)
from diagnosis.laws.readings import EXPONENT, Readings, from_log
from diagnosis.laws.slots import FAMILY, FreeLaw
from diagnosis.measurements import CONTACTS
from diagnosis.page.words import told
from diagnosis.rig import Rig
from diagnosis.table_model.block import LAW, Block, levels_of, refitted
from diagnosis.table_model.law import curve

DIGITS = 9  # decimals of what is written into a run spec


CURVES = {
    "restitution": ("damping", ("speed", "size")),
    "friction": ("friction", ("load", "speed", "size")),
}
"""Slot of a free law -> the engine's slot with a curve of that name, and the states that the curve
can depend on."""


def has_curve(law: FreeLaw | None) -> bool:
    """Return whether the engine has a curve in place of a law with experiment, slot and state.

    The rate of a tilt is no speed of sliding, and the load of a shear cell is not that of a
    contact."""
    if law is None or law.experiment not in CONTACTS or not law.state:
        return False
    return set(law.state) <= set(CURVES.get(law.slot, ("", ()))[1])


def not_run(law: Mapping[str, Any]) -> str:
    """Why the engine has no run with a law {experiment, slot, state, ...} of verdict.json."""
    place = law["experiment"], law["slot"], tuple(law["state"])
    found = [f for f in FAMILY if (f.experiment, f.slot, f.state) == place]
    return told("not_run.j2", law=law, beside=any(map(has_curve, found)))


Switch = Callable[[dict[str, Any], float], dict[str, Any]]
"""A function of a run spec (a mapping) and a coefficient that gives the spec with a law on."""


def switched_on(law: FreeLaw, values: Sequence[Mapping[str, float]]) -> tuple[Switch, float]:
    """`Switch` of a free law, the coefficient that in the middle of its states; and this
    coefficient as the values have it.

    values: [{state, value, ...}] at equal steps of the state's logarithm, as `law.curve` has them;
    the engine takes every few of them."""
    slot, states = CURVES[law.slot]
    coefficient, _, _ = COEFFICIENT[law.experiment]
    places = np.linspace(0, len(values) - 1, POINTS).round().astype(int)
    state, value = ([values[i][part] for i in places] for part in ("state", "value"))
    middle, name = value[POINTS // 2], f"{law.slot}_curve"
    found = {f"wall_{name}_{k}": round(v / middle, DIGITS) for k, v in enumerate(value, start=1)}
    found |= {f"{name}_low": state[0], f"{name}_ratio": state[-1] / state[0]}
    found |= {f"{name}_{s}_power": float(s in law.state) for s in states}

    def switch(spec, level):
        return with_coefficient(set_law(spec, slot, name, **found), coefficient, level)

    return switch, middle


MOST_SETTINGS = 12
"""Settings at most that are compared for one law."""


def some_of(levels: Sequence[Any]) -> list[np.ndarray]:
    """Of each level (settings) those to be run: at most so many in all, spread over the levels, and
    over the settings of a level in turn. levels: [indices (k,) of the settings of a level]."""
    some = np.round(np.linspace(0, len(levels) - 1, min(MOST_SETTINGS, len(levels)))).astype(int)
    each = max(MOST_SETTINGS // len(levels), 1)
    out = []
    for k, index in enumerate(levels):
        count = min(each, len(index)) if k in some else 0
        at = (np.arange(count) * len(index) // max(count, 1) + k) % len(index)
        out.append(np.sort(np.asarray(index)[at]))
    return out


@dataclass(frozen=True)
class Engine:
    """The engine's contacts for one rig and catalogue."""

    rig: Rig
    catalogue: Mapping

    def spec_of(self, experiment: str, levers: Mapping[str, float]) -> dict[str, Any]:
        """Run spec (a mapping) of a condition."""
        return self.rig.spec(Condition(experiment, dict(levers)), self.rig.settings.seed)

    def logs(self, switch: Switch, coefficient: float, readings: Readings) -> np.ndarray:
        """(n,) logarithms of the readings with a switch, NaN where the engine does not take it
        beside the study's own laws."""
        try:
            return contact_logs(lambda spec: switch(spec, coefficient), readings, self.spec_of)
        except SpecError:
            return np.full(len(readings.log), np.nan)


def shift(block: Block, key: str, name: str | None, engine: Engine) -> tuple[np.ndarray, bool]:
    """(n,) what a law adds to the logarithms of all readings of a block, and whether the engine
    said so. name: the mechanism that it stands for, or None for the curve."""
    term, readings = block.terms[key], block.readings
    fitted = block.part(key)
    if readings.experiment not in COEFFICIENT:
        return fitted, False
    coefficient, low, high = COEFFICIENT[readings.experiment]
    start = float(np.clip(np.exp(readings.centre[0] / EXPONENT[readings.experiment]), low, high))

    def constant(spec, value):
        return with_coefficient(spec, coefficient, value)

    plain = engine.logs(constant, start, readings)
    if name:
        own = tuple(s for s in term.shapes if s.name == name)
        held = block.without(key).holding(key, replace(term, shapes=own))
        mechanism = engine.catalogue[name]
        strength = float(mechanism.strength.natural(held.strength(key)))
        if mechanism.observe is not None:
            return observed_log(mechanism, strength, plain, readings) - plain, True

        def switch(spec, value):
            own_spec = spec if name in NO_COEFFICIENT else constant(spec, value)
            return mechanism.apply(own_spec, strength)

    elif term.free and has_curve(term.law):
        values = curve(block, key)
        switch, start = switched_on(term.law, values)
        start = float(np.clip(start, low, high))
    else:
        return fitted, False
    change = engine.logs(switch, start, readings) - plain
    return (change, True) if np.isfinite(change).all() else (fitted, False)


@dataclass(frozen=True)
class Compared:
    """Measurements and what is expected of them without and with something (n, 1), by a fit that
    had not seen their level; shared, refit: standard deviations of declared errors, and what the
    refitted terms leave open (n,), as `extend.gain` takes them; engine: what was run, or None."""

    measurements: list
    before: np.ndarray
    after: np.ndarray
    shared: dict
    refit: np.ndarray
    engine: dict | None


def gain_of(parts: Sequence[Compared]) -> dict[str, Any] | None:
    """The mapping `gain` of verdict.json of several experiments' `Compared` at once."""
    rows = [m for p in parts for m in p.measurements]
    before, after = (np.concatenate([getattr(p, n) for p in parts]) for n in ("before", "after"))
    shared = {k: v for p in parts for k, v in p.shared.items()}
    return gain(rows, before, after, shared=shared, refit=np.concatenate([p.refit for p in parts]))


def compared(
    measurements: Sequence[Measurement],
    block: Block,
    names: Mapping[str, str | None],
    engine: Engine,
) -> dict[str | None, Compared]:
    """{key: Compared} of the laws that are held in a block, the others being in both models, and
    under None of all of them; names: {key: mechanism that it is told as, or None}."""
    laws = [k for k, h in block.held.items() if h.term.kind == LAW]
    out = {key: _one(measurements, block, laws, [key], names, engine) for key in laws}
    out[None] = _one(measurements, block, laws, laws, names, engine) if laws[1:] else out[laws[0]]
    return out


def _one(measurements, block, laws, tested, names, engine):
    """`Compared` of some of the laws."""
    readings, term = block.readings, block.terms[tested[0]]
    lever, levels = levels_of(block, term.law)
    pairs = [(index, run) for index, run in zip(levels, some_of(levels), strict=True) if len(run)]
    before, after, left = (np.full(len(readings.log), np.nan) for _ in range(3))
    ran = []
    for index, run in pairs:
        held = refitted(block, index)
        shifts = {k: shift(held, k, names.get(k), engine) for k in laws}
        ran += [shifts[k][1] for k in tested]
        others = [held.part(k) for k in held.held if k not in laws]
        whole = sum(others) + sum(s for s, _ in shifts.values())
        less = whole - sum(shifts[k][0] for k in tested)
        for out, added in ((before, less), (after, whole)):
            out[run] = (held.readings.level(held.readings.log - added) + added)[run]
        left[run] = np.sqrt(held.expected()[1][run])
    own = np.flatnonzero(np.isfinite(before))
    before, after, wider = (
        from_log(readings.experiment, v, readings.levers)[own][:, None]
        for v in (before, after, after + left)
    )
    rows = [measurements[i] for i in readings.rows[own]]
    done = {"left_out": lever, "levels": len(pairs), "run": len(own), "of": len(readings.log)}
    done["keys"] = None
    if any(ran) and term.free and has_curve(term.law):
        switch, middle = switched_on(term.law, curve(block, term.key))
        done["keys"] = switch({}, middle)  # of a run spec, that switch the law on
    shared = {(readings.experiment, n): float(block.sd_of(n).max()) for n in readings.groups}
    refit = np.abs(wider - after)[:, 0]
    return Compared(rows, before, after, shared, refit, done if any(ran) else None)
