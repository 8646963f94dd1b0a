"""The test methods of a laboratory, from `methods.yaml`; each file here has the functions that make
a test of a study of the answers to one or a few methods that belong together."""

from collections.abc import Callable
from functools import cache
from importlib.resources import files
from pkgutil import resolve_name
from typing import Any

import yaml

from calibration.study.new.methods.declare import Answer, Entry, LaboratoryTest, Method, Question

__all__ = ["Answer", "Entry", "LaboratoryTest", "Method", "Question", "function_of", "methods"]


@cache
def methods() -> dict[str, Method]:
    """{name: Method} in the order in which they are asked."""
    text = files("calibration.study.new").joinpath("methods.yaml").read_text("utf-8")
    return {
        name: Method(name, rank=rank, **told | {"questions": _questions(told)})
        for rank, (name, told) in enumerate(yaml.safe_load(text).items())
    }


def _questions(told):
    lists = ({k: tuple(v) if isinstance(v, list) else v for k, v in q.items()}
             for q in told["questions"])  # fmt: skip
    return tuple(Question(**q) for q in lists)


def function_of(name: str) -> Callable[..., Any]:
    """The function that a method names, `heaps:funnel`. Its file is loaded now: what makes options
    needs none of them."""
    function: Callable[..., Any] = resolve_name(f"{__name__}.{name}")
    return function
