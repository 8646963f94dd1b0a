"""Two simulations that disagree: another code's runs, read as measurements at known parameters.

Nothing is calibrated, for each row says which parameters it was run with. What is asked is which
mechanism of the catalogue, numerical setting or reading, switched on in our own simulation at one
strength, brings it to the other's values; `diagnosis.compared` judges that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calibration.errors import ConfigError
from calibration.intake.measurements import read_measured
from calibration.intake.quantities import QUANTITIES
from calibration.intake.tables import read_table
from diagnosis.collision import coarse_rebounds
from diagnosis.contacts import integrated
from diagnosis.design import WIDENED
from diagnosis.measurements import CONTACTS

if TYPE_CHECKING:
    from pathlib import Path

    from calibration.intake.measurements import Measurement
    from calibration.study.factors import Choice, Factor
    from diagnosis.catalogue import Mechanism
    from diagnosis.model import Model
    from diagnosis.rig import Rig


STRENGTHS = 11
LEAST_ROWS = 4


@dataclass(frozen=True)
class Cause:
    """What may differ: our values (k, n) at each of its strengths (k,), in `unit`.

    noise: (k, n) standard deviation of a value of theirs under the cause, where it scatters by its
    own nature; in the quantity's unit. spread: standard deviation of the difference of two runs
    that differ by their seeds alone, theirs and ours under the cause, where that is known; else the
    one of all ours counts."""

    name: str
    kind: str
    unit: str
    strengths: np.ndarray
    values: np.ndarray
    noise: np.ndarray | None = None
    spread: float | None = None


@dataclass(frozen=True)
class Convention:
    """A way to read or to compute that is no law of nature: strengths, and what they make of our
    value: (value (n,), levers, strength) -> (n,)."""

    name: str
    unit: str
    strengths: np.ndarray
    read: object


def _shares(most, steps=STRENGTHS):
    return np.linspace(-most, most, 2 * (steps // 2) + 1)


def _of_height(value, levers, exponent):
    height = np.array([x["drop_height_mm"] for x in levers])
    return height * (value / height) ** exponent


CONVENTIONS = {
    "drop": (
        Convention("reading off by a length", "mm", _shares(5.0), lambda v, x, s: v + s),
        Convention("rebound in proportion", "share", _shares(0.5), lambda v, x, s: v * (1.0 + s)),
        Convention("another damping: restitution to a power", "1", np.linspace(0.5, 2.0, 31),
        _of_height),
    ),
    "tilt": (
        Convention("reading off by an angle", "deg", _shares(3.0), lambda v, x, s: v + s),
        Convention("friction in proportion", "share", _shares(0.3),
        lambda v, x, s: np.degrees(np.arctan((1.0 + s) * np.tan(np.radians(v))))),
        Convention("angle read in whole steps", "deg", np.array([0.5, 1.0, 1.25, 2.0, 2.5, 5.0]),
        lambda v, x, s: s * np.round(v / s)),
        Convention("angle at the end of a step", "deg", np.array([0.5, 1.0, 1.25, 2.0, 2.5, 5.0]),
        lambda v, x, s: s * np.ceil(v / s)),
    ),
    "heap": (
        Convention("reading off by an angle", "deg", _shares(10.0, 41), lambda v, x, s: v + s),
        Convention("slope in proportion", "share", _shares(0.3),
        lambda v, x, s: np.degrees(np.arctan((1.0 + s) * np.tan(np.radians(v))))),
    ),
}  # fmt: skip
STEPS = np.array([0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.8])
"""Time steps over Rayleigh's that are tried for a bounce, up to the largest that the engine takes.
A contact of the salt has 39 steps at the first, 20 at the second, and 2.5 at the last."""


def read_runs(
    path: str | Path, factors: Sequence[Factor | Choice], quantity: str | None = None
) -> list[Measurement]:
    """Measurements of another code's runs, with `known` of the factors that are columns. quantity:
    which rows count, those of what the experiment measures first unless given. Raises ConfigError
    for a table with fewer than `LEAST_ROWS` runs of any experiment."""
    columns = read_table(path).header
    rows = list(read_measured(path, [f.name for f in factors if f.name in columns]).conditions)
    rows = [m for m in rows if not m.outcome]
    rows = [m for m in rows if m.quantity == (quantity or QUANTITIES[m.experiment].name)]
    counts = {k: sum(m.experiment == k for m in rows) for k in {m.experiment for m in rows}}
    if min(counts.values(), default=0) < LEAST_ROWS:
        raise ConfigError(
            "has too few runs to tell anything apart",
            path=path,
            value=", ".join(f"{k}: {n}" for k, n in counts.items()) or 0,
            allowed=f"at least {LEAST_ROWS} runs of an experiment",
        )
    return rows


def conventions(runs: Sequence[Measurement], ours: np.ndarray) -> list[Cause]:
    """[`Cause`]: the ways to read one experiment's runs that are tried on our values (n,)."""
    levers = [m.levers for m in runs]
    return [
        Cause(c.name, "convention", c.unit, c.strengths,
        np.array([c.read(ours, levers, s) for s in c.strengths]))  # type: ignore[operator]
        for c in CONVENTIONS.get(runs[0].experiment, ())
    ]  # fmt: skip


def _need_parameters(runs, kind, factors):
    """Raise ConfigError where the runs of an experiment do not say what one of its parameters was:
    the value of our own run spec would stand in its place."""
    known = dict(runs[0].known)
    for f in factors:
        if f.name not in known:
            allowed = f"the value of {f.key} that each run was made with"
            found = ", ".join(known) or None
            reason = f"is no column of the runs of {kind}"
            raise ConfigError(reason, column=f.name, value=found, allowed=allowed)


def of_contacts(
    runs: Sequence[Measurement], rig: Rig, catalogue: Mapping[str, Mechanism]
) -> tuple[np.ndarray, list[Cause]]:
    """(ours (n,), [`Cause`]) of one experiment's drops or slides, integrated by the engine.
    Raises ConfigError for an experiment of many grains, and for runs without a column of one of the
    experiment's parameters."""
    kind = runs[0].experiment
    if kind not in CONTACTS:
        raise ConfigError("is no single contact", value=kind, allowed=" and ".join(CONTACTS))
    own = rig.settings.experiments[kind].parameters
    _need_parameters(runs, kind, [f for f in rig.factors if f.key in own])  # type: ignore[operator]  # `derived` fills it in
    specs = [rig.spec(m.condition, rig.settings.seed, dict(m.known)) for m in runs]
    ours = np.array([integrated(s, m) for s, m in zip(specs, runs, strict=True)])
    causes = conventions(runs, ours)
    if kind == "drop":
        causes.append(_time_step(specs, runs))
    for mechanism in catalogue.values():
        if kind in mechanism.experiments:
            causes.append(_mechanism(mechanism, specs, runs, ours))
    return ours, causes


def _time_step(specs, runs):
    """`Cause` of drops whose contacts have few steps. A run that is the mean of n bounces scatters
    by their phases over the root of n."""
    found = [
        [coarse_rebounds(s, m.levers["drop_height_mm"], float(share))
        for s, m in zip(specs, runs, strict=True)]
        for share in STEPS
    ]  # fmt: skip
    values, scatter = np.moveaxis(np.array(found), 2, 0)
    noise = scatter / np.sqrt([m.n for m in runs])
    return Cause("time step", "numerical", "of Rayleigh", STEPS, values, noise)


def _mechanism(mechanism, specs, runs, ours):
    coded, values = np.linspace(0.0, 1.0, STRENGTHS), []
    for c in coded:
        strength = float(mechanism.strength.natural(c))
        if mechanism.observe is not None:
            seen = [mechanism.observe(v, m.levers, strength)
            for v, m in zip(ours, runs, strict=True)]  # fmt: skip
        else:
            seen = [integrated(mechanism.apply(s, strength), m)
            for s, m in zip(specs, runs, strict=True)]  # fmt: skip
        values.append(seen)
    natural = np.array([mechanism.strength.natural(c) for c in coded])
    unit = mechanism.strength.unit
    return Cause(mechanism.name, "mechanism", unit, natural, np.array(values, float))


def emulated(
    runs: Sequence[Measurement], model_of: Callable[[tuple[str, ...]], Model], names: Iterable[str]
) -> tuple[np.ndarray, list[Cause]]:
    """(ours (n,), [`Cause`]) of one experiment's runs by emulators.

    model_of: names of mechanisms -> `diagnosis.model.Model` of the runs' conditions. Raises
    ConfigError for runs whose parameters the emulators do not have or do not cover."""
    base = model_of(())
    known = _covered(runs, base.factors)
    ours, causes = _own(base, known), []
    for name in names:
        model = model_of((name,))
        coded = np.linspace(0.0, 1.0, STRENGTHS)
        values = [_own(model, np.column_stack([known, np.full(len(runs), c)])) for c in coded]
        strength = model.mechanisms[0].strength
        natural = np.array([strength.natural(c) for c in coded])
        causes.append(Cause(name, "mechanism", strength.unit, natural, np.array(values)))
    return ours, causes


def _covered(runs, factors):
    """Coded levels (n, p) of the emulators' factors in each run. Raises ConfigError for a column
    that is missing, for one that the emulators do not have, and for a level beyond their range."""
    kind = runs[0].experiment
    _need_parameters(runs, kind, factors)
    strange = set(dict(runs[0].known)) - {f.name for f in factors}
    if strange:
        names = ", ".join(f.name for f in factors)
        allowed = f"{names}; leave a column out whose value is that of the experiment's run spec"
        reason = f"is no parameter of the emulators of {kind}"
        raise ConfigError(reason, column=min(strange), allowed=allowed)
    levels = np.array([[f.coded(dict(m.known)[f.name]) for f in factors] for m in runs])
    for m, k in zip(runs, np.argmax(np.abs(levels), axis=1), strict=True):
        f, value = factors[k], dict(m.known)[factors[k].name]
        if abs(f.coded(value)) > WIDENED:
            low, high = f.natural(-WIDENED), f.natural(WIDENED)
            where = {"line": m.line, "column": f.name, "value": value}
            reason, allowed = "is outside what the emulators cover", f"{low:g} to {high:g}"
            raise ConfigError(reason, **where, allowed=allowed)
    return levels


def _own(model, theta):
    """(n,) what the model says of run i at the parameters of run i."""
    return np.diagonal(model.predict(theta)[0]).copy()
