"""What a stage declares of itself; the workflow's rules, the report and the progress are made from
it.

A declaration names functions as "module:function", so that reading all declarations loads none of
the libraries that the functions need.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

PLANNED = ("seed", "experiment", "fixed", "run", "factors")
"""Sections of the configuration that every plan of runs reads."""
TARGETS = ("target", "further_targets", "measurements", "experiment", "run")
"""What a stage reads that compares with measured values: they are those at the run's levers."""


@dataclass(frozen=True)
class Figure:
    """A figure among a task's outputs: its caption is workflow/report/<caption>.rst, `numbers` are
    the files beside it that hold what it shows."""

    file: str
    caption: str
    numbers: tuple[str, ...] = ()


@dataclass(frozen=True)
class PerTarget:
    """A file of each further target, `{}` standing for its metric; only of measured ones if so."""

    pattern: str
    measured: bool = False


@dataclass(frozen=True)
class Runs:
    """An input: the finished runs of the plan in a folder of the study."""

    plan: str


def bench_values(study):
    """An input of all plans of heaps: what the bench tests found, where the configuration takes it
    from there."""
    return [f"{study.folder}/bench/fixed.json"] if study.config.fixed_from == "bench" else []


@dataclass(frozen=True)
class Task:
    """One rule of the workflow; the function bears the rule's name.

    function : "module:function", called with (study, inputs, outputs)
    message : of the rule
    reads : sections of the configuration that it may read
    inputs : {name: file below the study's folder, `Runs`, or a function of the study that gives
        paths}
    outputs : {name: file below the study's folder, `Figure` or `PerTarget`}
    plans : folder of the plan that it writes
    seeds : which thousand of seeds its runs have, no other stage's; the study's first seeds, which
        other stages may have too, where None
    batches : processes that share these runs, or a function of the study; where None, as many as
        the cost of a run asks for
    failures : "refused" or "kept"
    needs : keys that must be given
    cheap : it takes seconds and is not sent to a cluster
    expected : number of runs by the configuration, before they are planned, for the progress; None
        where only earlier runs tell
    """

    function: str
    message: str
    reads: tuple[str, ...] = ()
    inputs: dict | None = None
    outputs: dict | None = None
    plans: str | None = None
    seeds: int | None = None
    batches: int | Callable | None = None
    failures: str = "refused"
    needs: tuple[str, ...] = ()
    cheap: bool = True
    expected: Callable | None = None

    @property
    def rule(self):
        """Name of the rule and of the function."""
        return self.function.split(":")[1]

    def load(self):
        """The function itself."""
        return resolve(self.function)

    def files(self):
        """{name: output} with the design and the plan where it plans runs."""
        own = {"design": f"{self.plans}/design.csv", "plan": f"{self.plans}/plan.json"}
        files = (own if self.plans else {}) | (self.outputs or {})
        return {name: file for name, file in files.items() if file is not None}

    @property
    def log(self):
        """Name of the rule's log, with the wildcards of its outputs."""
        first = next(iter(self.files().values()))
        wildcards = re.findall(r"\{\w+\}", getattr(first, "file", str(first)))
        return "_".join([self.rule, *wildcards])


@dataclass(frozen=True)
class Stage:
    """A stage: its tasks, and what the report says of it.

    place: order on the page, of which the whole number is the category of snakemake's own report;
    tables: (file without suffix, title); sentences: "module:function" that gives lines of text from
    the stage's summary and the response; about: a line for a stage whose folder is shown as it is,
    without the columns `unshown` {table: columns}; pictured: the plan whose heaps are
    shown; category: in snakemake's own report, the title unless given.
    """

    name: str
    title: str
    place: float
    tasks: tuple[Task, ...]
    tables: tuple[tuple[str, str], ...] = ()
    sentences: str | None = None
    about: str | None = None
    unshown: tuple[str, ...] = ()
    pictured: str | None = None
    category: str | None = None

    @property
    def figures(self):
        """Figures among the outputs of all tasks."""
        outputs = [f for task in self.tasks for f in task.files().values()]
        return [f for f in outputs if isinstance(f, Figure)]

    @property
    def heading(self):
        """Category in snakemake's own report."""
        return f"{int(self.place)} {self.category or self.title}"

    @property
    def result(self):
        """The file that shows that the stage is done: the first output of its last task."""
        first = next(iter(self.tasks[-1].files().values()))
        return getattr(first, "file", first)


def resolve(name):
    """The function of "module:function"."""
    module, function = name.split(":")
    return getattr(import_module(module), function)
