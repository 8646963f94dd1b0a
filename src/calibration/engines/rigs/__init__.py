"""What other codes run beside heap and drop: each experiment is one file here, for every code.

A file bears its experiment's name. It has `deck(spec, dialect, folder)`, which gives the text of a
deck and writes what it reads, and `read(spec, folder, output)`, which gives metrics and last state.
`NEEDS` names the members of a dialect that may be missing and that it cannot do without.
A rig writes the commands that the codes have in common and reads its metrics from what they leave.
What differs between the codes, it asks of their `Dialect`: how walls stand, move and go.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import ModuleType


@dataclass(frozen=True)
class Dialect:
    """How a code says what a rig needs. Each member gives lines of its deck."""

    head: Callable
    """head(spec, space, radius): units, laws and gravity; space: lines that make the box, radius:
    of the smallest grain [m]."""
    walls: Callable
    """walls(bodies, folder, moves=None, lid=None): the bodies of a `WallSet`; moves: the name of
    one that `lift` moves, lid: the `Lid` among them."""
    lift: Callable
    """lift(name, speed): the body rises from now on with `speed` [m/s]."""
    hold: Callable
    """hold(name): it stands still where it is."""
    remove: Callable
    """remove(walls, name): the body is gone."""
    load: Callable | None = None
    """load(lid): the lid presses from now on with the variable `force`. None where the code has no
    lid that a load presses."""
    height: Callable | None = None
    """height(lid): an expression of its height [m]."""
    turn: Callable | None = None
    """turn(name, rate): the body turns about z from now on with `rate` [rad/s]."""
    stop: Callable | None = None
    """stop(name): it turns no more."""
    watch: Callable | None = None
    """watch(label, name, steps): from now on LABEL.txt gets step, force along z [N] and torque
    about z [N m] on the body, means of so many `steps`."""


@dataclass(frozen=True)
class Lid:
    """A wall that moves along z as a load and the grains press it."""

    name: str
    height: float
    """Where it starts [m]."""
    force: float
    """What it presses down with at first [N]."""
    mass: float
    """[kg]"""
    mobility: float
    """Speed for each newton that is out of balance, which damps it [m/s/N]."""
    speed: float
    """Its greatest speed [m/s]."""


@cache
def rigs() -> dict[str, ModuleType]:
    """{experiment: module} of all files of this package."""
    names = [m.name for m in pkgutil.iter_modules(__path__)]
    return {name: importlib.import_module(f"{__name__}.{name}") for name in names}


def experiments_of(dialect: Dialect) -> list[str]:
    """Experiments whose rigs find in a `Dialect` what they need."""
    return [
        name
        for name, rig in rigs().items()
        if all(getattr(dialect, need) for need in getattr(rig, "NEEDS", ()))
    ]
