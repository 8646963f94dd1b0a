"""The test methods of a laboratory: each file declares one, its questions and what the answers
become."""

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from calibration.study.new.methods.declare import Answer, Entry, LaboratoryTest, Method, Question

__all__ = ["Answer", "Entry", "LaboratoryTest", "Method", "Question", "methods"]


@cache
def methods() -> dict[str, Method]:
    """{name: Method} in the order in which they are asked."""
    names = (f"{__name__}.{m.name}" for m in iter_modules(__path__))
    found = [getattr(import_module(name), "METHOD", None) for name in names]
    return {m.name: m for m in sorted(filter(None, found), key=lambda m: (m.rank, m.name))}
