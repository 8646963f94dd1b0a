"""A study: its configuration, factors, measured values and what its stages have left.

The workflow hands one to each stage, narrowed to the sections of the configuration that the stage
declares; in Python `Study("wheat")` opens one from its folder.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.runs.plans import plan, together
from calibration.statistics.equivalence import Stated
from calibration.study.config import Config, read_target
from calibration.study.config.schema import VIEWS
from calibration.study.factors import Factor, read_factors
from calibration.study.simulated_tests import SimulatedTest, ratios, sized
from calibration.study.stage import Points

ALWAYS = ("name", "results")  # where a study's files are; it decides none of their content
OF = {"run_of": "tests", "of_experiment": "tests"}
"""Methods of a `Config`: the section that they read."""


class NamedFiles(Protocol):
    """Input or output files of a rule: each attribute is the path, or the list of paths, that
    stands under this name in the rule's `input` or `output`."""

    def __getattr__(self, name: str) -> Any: ...

    def __iter__(self) -> Iterator[Any]: ...

    def get(self, name: str, default: Any = None) -> Any:
        """The path or paths of a name, `default` where the rule has none of it."""


class UndeclaredError(CalibrationError):
    """A stage reads a section of the configuration that its declaration does not name."""


class Sections:
    """Those sections of a `Config` that a stage declares; another one raises UndeclaredError."""

    def __init__(self, config: Config, names: Iterable[str]) -> None:
        self._config, self._names = config, tuple(names)

    def __getattr__(self, key):
        section = OF.get(key, key)
        known = section in Config.model_fields or section in VIEWS
        if known and section not in (*self._names, *ALWAYS):
            raise UndeclaredError(f"the stage reads {key}, but declares {', '.join(self._names)}")
        return getattr(self._config, key)

    def model_copy(self, update: Mapping[str, Any]) -> "Sections":
        """A copy with some sections changed."""
        return Sections(self._config.model_copy(update=update), self._names)


class Results:
    """What the stages of a study have left in its folder; a stage that has not run gives None."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.name = self.folder.name

    def summary(self, stage: str, name: str | None = None) -> Any:
        """Summary of a stage as a mapping, or None; `name`: another JSON file of it, such as the
        list of factors `region`."""
        names = [name] if name else [stage, "optimum"]
        paths = [self.folder / stage / f"{n}.json" for n in names]
        return next((read_json(p) for p in paths if p.is_file()), None)

    def table(self, stage: str, name: str) -> pd.DataFrame | None:
        """Table `name`.csv of a stage as a data frame, or None."""
        path = self.folder / stage / f"{name}.csv"
        return read_written(path) if path.is_file() else None


class Study(Results):
    """A study with its configuration; see the module."""

    def __init__(
        self, config: Config, folder: str | Path | None = None, seeds: int | None = None
    ) -> None:
        """seeds: which thousand of seeds the runs have that a stage plans, see
        `calibration.runs.plans.plan`."""
        super().__init__(folder or f"{config.results}/{config.name}")
        self.config, self.seeds = config, seeds

    def with_bench(self, files: Iterable[str | Path]) -> "Study":
        """This study with the levels that the bench tests found, files of them, in place of its
        own."""
        config = self.config
        for file in files:
            found = read_json(file)["fixed"]
            config = config.model_copy(update={"fixed": config.fixed | found})
        return Study(config, self.folder)

    def reading(self, sections: Iterable[str], seeds: int | None = None) -> "Study":
        """This study for a stage that declares these sections of the configuration and these
        seeds."""
        return Study(Sections(self.config, sections), self.folder, seeds)  # type: ignore[arg-type]  # answers as one

    @cached_property
    def factors(self) -> list[Factor]:
        """The factors of the table, in its order. Raises ConfigError."""
        return read_factors(self.config.factors)

    def measured(self) -> np.ndarray | Stated:
        """(n,) readings of the target, or a `Stated` mean of them. Raises ConfigError."""
        return read_target(self.config)

    def bench_levels(self) -> dict[str, float]:
        """{factor: level} that the bench tests found, where the study takes its levels from
        them."""
        found = self.summary("bench", "fixed") if self.config.fixed_from == "bench" else None
        return found["fixed"] if found else {}

    def plan(
        self,
        design: pd.DataFrame,
        experiment: str | None = None,
        run: Mapping[str, Any] | None = None,
        seed: int | None = None,
    ) -> tuple[pd.DataFrame, dict[str, dict[str, Any]]]:
        """The design table (pandas) with seeds and run names, and {run name: spec}; see
        `calibration.runs.plans.plan`.

        experiment, run, seed: in place of the configuration's own.
        """
        config = self.config if seed is None else self.config.model_copy(update={"seed": seed})
        kind = experiment or config.experiment
        base = config.own_run if run is None else run
        return plan(design, self.factors, config, kind, base, self.seeds)

    def plan_points(
        self, points: Iterable[Points]
    ) -> tuple[pd.DataFrame, dict[str, dict[str, Any]]]:
        """`plan` for the points of one run spec or of several, as one table."""
        return together(self.plan(p.design, p.experiment, p.run) for p in points)

    def plan_test(
        self, design: pd.DataFrame, test: SimulatedTest, seed: int | None = None
    ) -> tuple[pd.DataFrame, dict[str, dict[str, Any]]]:
        """`plan` for a test of the laboratory: with the levels that it holds, and those that its
        grains have where they are of another size. The table keeps the levels of the study."""
        by = ratios(self.config, test, [f.key for f in self.factors])
        names = [f.name for f in self.factors if f.name in design]
        levels = self.config.fixed | {name: design[name] for name in names}
        grown = {
            f.name: np.round(levels[f.name] * by[f.key], 9)
            for f in self.factors
            if f.key in by and f.name in levels
        }
        held = design.assign(**{**grown, **test.fixed})
        table, specs = self.plan(held, test.experiment, sized(test.run, by), seed)
        beside = (set(test.fixed) | set(grown)) - set(names)
        own = {name: design[name].to_numpy() for name in names}
        return table.drop(columns=list(beside)).assign(**own), specs


def read_region(path: str | Path) -> list[Factor]:
    """Factors with the levels of a region: of a region.json, or of an optimum.json the one that it
    was sought in."""
    content = read_json(path)
    return [Factor(**f) for f in (content["region"] if "region" in content else content)]
