"""The stages of a study: each file of this folder declares one, with its neighbours where they
belong together.

A stage is added by a file here, and the functions that it names.
"""

from importlib import import_module
from pkgutil import iter_modules

from calibration.study.stages.stage import Figure, PerTarget, Runs, Stage, Task, resolve

OWN = "calibration.study.stages"

__all__ = [
    "OWN", "Figure", "PerTarget", "Runs", "Stage", "Task", "expected_runs", "expecting",
    "load_stages", "planning", "resolve",
]  # fmt: skip


def load_stages(*names):
    """{name: Stage} in the order of the report, declared in modules or in all modules of packages;
    this one unless given. Raises ValueError where two stages declare the same seeds."""
    found = [stage for name in names or (OWN,) for stage in _declared(import_module(name))]
    owners = {}
    for stage, task in ((s, t) for s in found for t in s.tasks if t.seeds is not None):
        owner, other = owners.setdefault(task.seeds, (stage.name, task.rule))
        if owner != stage.name:
            raise ValueError(f"{other} and {task.rule} declare the same seeds, {task.seeds}")
    return {stage.name: stage for stage in sorted(found, key=lambda stage: stage.place)}


def _declared(module):
    if hasattr(module, "__path__"):
        for inside in iter_modules(module.__path__):
            yield from _declared(import_module(f"{module.__name__}.{inside.name}"))
    yield from getattr(module, "STAGES", ())


def planning():
    """The declared tasks that plan runs, those beside the chain first, in the stages' order."""
    tasks = [task for stage in load_stages().values() for task in stage.tasks if task.plans]
    return sorted(tasks, key=lambda task: bool(task.expected))


def expected_runs(config):
    """Number of runs of a study before any has been planned."""
    return sum(task.expected(config) for task in expecting())


def expecting():
    """The declared tasks whose number of runs is known before they plan them, in the stages'
    order."""
    return [task for task in planning() if task.expected]
