"""Modules of the engine that are loaded when a run first uses something of them: a schema must not
wait a second for them."""

from __future__ import annotations

import importlib.util
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType


def lazily(name: str) -> ModuleType:
    """The module `name`; its code runs at the first access to one of its attributes."""
    if name in sys.modules:
        return sys.modules[name]
    found = importlib.util.find_spec(name)
    found.loader = importlib.util.LazyLoader(found.loader)  # type: ignore[union-attr,arg-type]
    module = importlib.util.module_from_spec(found)  # type: ignore[arg-type]
    sys.modules[name] = module
    found.loader.exec_module(module)  # type: ignore[union-attr]
    return module


bed, outflow = lazily("dem.experiments.bed"), lazily("dem.experiments.outflow")
phases, setup = lazily("dem.experiments.phases"), lazily("dem.experiments.setup")
builder, drag = lazily("dem.walls.builder"), lazily("dem.kernel.drag")
