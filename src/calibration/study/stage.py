"""What a stage says of itself to those that show it: its place on the page, its tables and figures,
and its plans of runs; and how the stages are found.

What a stage reads and writes stands in its rules alone (`workflow/rules`). All declarations are
read whenever a study is opened, so their modules load no library that computes or draws.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Any

import pandas as pd

from calibration.study.config import Config
from calibration.study.factors import Factor, read_factors

OWN = "calibration.stages"
"""Package with a module for each stage, or for those that belong together."""
BESIDE = 7
"""Place from which stages stand beside the calibration: bench tests, scaling, numerics, audits."""


@dataclass(frozen=True)
class Figure:
    """A figure of the page: its file without suffix in the stage's folder; `numbers` are the files
    beside it that hold what it shows."""

    name: str
    numbers: tuple[str, ...] = ()


@dataclass(frozen=True)
class Points:
    """Runs of one run spec, a row of `design` each. A factor that has no column is at the level
    that the study holds it at. key : of the configuration, where a level of them stands."""

    key: str
    design: pd.DataFrame
    experiment: str
    run: Mapping[str, Any]


@dataclass(frozen=True)
class Plan:
    """Runs that a stage plans.

    folder : of the plan, in the study's
    ahead : the `Points` of its runs by the configuration and the factors, before they are planned,
        from the function that plans them; what only earlier runs tell has no column. None where
        these tell the number too
    batches : processes that share these runs, or a function of the study; where None, as many as
        the cost of a run asks for
    kept : whether the stage goes on without runs that fail physically
    """

    folder: str
    ahead: Callable[[Config, Sequence[Factor]], list[Points]] | None = None
    batches: int | Callable | None = None
    kept: bool = False

    def expected(self, config: Config) -> list[str]:
        """Return the experiment of each run as far as the configuration tells them."""
        ahead = self.ahead(config, read_factors(config.factors)) if self.ahead else []
        return [points.experiment for points in ahead for _ in range(len(points.design))]


@dataclass(frozen=True)
class Stage:
    """A stage: its plans of runs, and what the page says of it.

    name : of its folder in the study's; place : order on the page; chain : whether every study
    makes it; searches : but one that begins where the atlas expects the parameters; tables : (file
    without suffix, title); sentences : gives lines of text from the stage's summary and the
    response; about : a line for a stage whose folder is shown as it is, without the columns
    `unshown` {table: columns}; pictured : the plan whose heaps are shown; made_by : the rule that
    ends it, which bears its name unless given; also_made_by : names of the rules before it whose
    files page and crate hold, by the configuration; those of its plans, `plan_<folder>`, unless
    given.
    """

    name: str
    title: str
    place: float
    chain: bool = False
    searches: bool = False
    plans: tuple[Plan, ...] = ()
    figures: tuple[Figure, ...] = ()
    tables: tuple[tuple[str, str], ...] = ()
    sentences: Callable[..., list[str]] | None = None
    about: str | None = None
    unshown: tuple[str, ...] = ()
    pictured: str | None = None
    made_by: str | None = None
    also_made_by: Callable[[Any], tuple[str, ...]] | None = None

    def of(self, config: Config) -> bool:
        """Return whether a study makes it of its own accord."""
        own = self.chain and not (self.searches and config.by_atlas)
        return own or self.name in config.supplements

    @property
    def rule(self) -> str:
        """Name of the rule that ends the stage: what is asked of snakemake for it."""
        return self.made_by or self.name

    def rules(self, config: Any) -> list[str]:
        """Names of the rules whose files page and crate hold, the last one ends the stage."""
        if self.also_made_by:
            return [*self.also_made_by(config), self.rule]
        return [*(f"plan_{plan.folder}" for plan in self.plans), self.rule]

    @property
    def folders(self) -> set[str]:
        """Its folder and those of its plans, in the study's."""
        return {self.name, *(plan.folder for plan in self.plans)}

    @property
    def supplement(self) -> bool:
        """Return whether it stands in the annex of the printed page: it is no step of the
        calibration, nor a verdict on it."""
        return self.place >= BESIDE


def load_stages(*names: str) -> dict[str, Stage]:
    """{name: Stage} in the order of the report, declared in modules or in all modules of packages;
    those of `OWN` unless given."""
    found = [stage for name in names or (OWN,) for stage in _declared(import_module(name))]
    return {stage.name: stage for stage in sorted(found, key=lambda stage: stage.place)}


def _declared(module: ModuleType) -> Iterator[Stage]:
    for inside in iter_modules(getattr(module, "__path__", ())):
        yield from _declared(import_module(f"{module.__name__}.{inside.name}"))
    yield from getattr(module, "STAGES", ())


def planning(config: Config) -> list[tuple[Plan, bool]]:
    """The declared plans and whether the study makes each of its own accord, those that it does not
    first, in the stages' order."""
    found = [(plan, stage.of(config)) for stage in load_stages().values() for plan in stage.plans]
    return sorted(found, key=lambda pair: pair[1])
