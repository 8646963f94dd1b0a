"""What other codes run beside heap and drop: each experiment is one file here, for every code.

A file bears its experiment's name. It has `deck(spec, dialect, folder)`, which gives the text of a
deck and writes what it reads, and `read(spec, folder, output)`, which gives metrics and last state.
A rig writes the commands that the codes have in common and reads its metrics from what they leave.
What differs between the codes, it asks of their `Dialect`: how walls stand, move and go.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache


@dataclass(frozen=True)
class Dialect:
    """How a code says what a rig needs. Each member gives lines of its deck."""

    head: Callable
    """head(spec, space, radius): units, laws and gravity; space: lines that make the box, radius:
    of the smallest grain [m]."""
    walls: Callable
    """walls(bodies, folder, moves=None): the bodies of a `WallSet`; moves: the name of one that
    `lift` moves. Raises EngineError for a wall that the code does not have."""
    lift: Callable
    """lift(name, speed): the body rises from now on with `speed` [m/s]."""
    hold: Callable
    """hold(name): it stands still where it is."""
    remove: Callable
    """remove(walls, name): the body is gone."""


@cache
def rigs():
    """{experiment: module} of all files of this package."""
    names = [m.name for m in pkgutil.iter_modules(__path__)]
    return {name: importlib.import_module(f"{__name__}.{name}") for name in names}
