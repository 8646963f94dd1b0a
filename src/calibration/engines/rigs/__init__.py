"""What other codes run beside heap and drop: each experiment is one file here, for every code.

A file bears its experiment's name. It has `deck(spec, code, folder)`, which gives the text of a
deck and writes what it reads, and `read(spec, folder, output)`, which gives metrics and last state.
A rig writes the commands that the codes have in common and reads its metrics from what they leave.
What differs between the codes, it asks of their `family.Code`: how walls stand, move and go.
"""

import importlib
import pkgutil
from dataclasses import dataclass
from functools import cache
from types import ModuleType


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
