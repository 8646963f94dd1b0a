"""The test methods of a laboratory: each file declares one or a few that belong together,
their questions and what the answers become."""

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from calibration.study.new.methods.declare import Answer, Entry, LaboratoryTest, Method, Question

__all__ = ["Answer", "Entry", "LaboratoryTest", "Method", "Question", "methods"]


@cache
def methods() -> dict[str, Method]:
    """{name: Method} in the order in which they are asked."""
    names = (f"{__name__}.{m.name}" for m in iter_modules(__path__))
    found = [m for name in names for m in getattr(import_module(name), "METHODS", ())]
    return {m.name: m for m in sorted(found, key=lambda m: (m.rank, m.name))}
