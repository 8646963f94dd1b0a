"""The stages of a study as the page and the progress show them: each file of this folder declares
one, with its neighbours where they belong together.

A stage is added by its rules in `workflow/rules`, the functions that these call, and a file here.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from calibration.study.stages.stage import Figure, Plan, Stage, resolve

if TYPE_CHECKING:
    from calibration.study.config import Config


OWN = "calibration.study.stages"

__all__ = [
    "OWN", "Figure", "Plan", "Stage", "expected_runs", "expecting", "load_stages", "planning",
    "resolve",
]  # fmt: skip


def load_stages(*names: str) -> dict[str, Stage]:
    """{name: Stage} in the order of the report, declared in modules or in all modules of packages;
    this one unless given."""
    found = [stage for name in names or (OWN,) for stage in _declared(import_module(name))]
    return {stage.name: stage for stage in sorted(found, key=lambda stage: stage.place)}


def _declared(module):
    if hasattr(module, "__path__"):
        for inside in iter_modules(module.__path__):
            yield from _declared(import_module(f"{module.__name__}.{inside.name}"))
    yield from getattr(module, "STAGES", ())


def planning() -> list[Plan]:
    """The declared plans, those beside the chain first, in the stages' order."""
    plans = [plan for stage in load_stages().values() for plan in stage.plans]
    return sorted(plans, key=lambda plan: bool(plan.expected))


def expected_runs(config: Config) -> int:
    """Number of runs of a study before any has been planned."""
    return sum(plan.expected(config) for plan in planning() if plan.expected)


def expecting() -> list[Plan]:
    """The declared plans whose number of runs is known before they are made, in the stages'
    order."""
    return [plan for plan in planning() if plan.expected]
