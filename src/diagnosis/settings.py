"""Settings of the diagnosis and the run spec of a condition."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from calibration.errors import ConfigError, first_fault
from calibration.intake.measurements import Measurement, raise_faults
from calibration.intake.quantities import LEVERS, QUANTITIES
from calibration.study.config import Config, overlay
from calibration.study.factors import Factor, read_factors
from diagnosis.catalogue import Mechanism, load_catalogue

BASE = "base"
"""The model without any mechanism, where one is named."""

SIMULATED = {name for name, lever in LEVERS.items() if lever.place}

Range = Annotated[list[float], Field(min_length=2, max_length=2)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Experiment(_Part):
    """How one experiment is simulated. What is not given follows from the study
    (`diagnosis.setup`).

    metric: of a run, that the measurement is compared with; parameters: keys of the run spec whose
    factors are calibrated on it; levers: least and largest value of the emulator of those that
    differ between the measurements; held: the one value of those that do not; levels: those at
    which the runs of a budget are made, spread over the lever's range unless given; ended_by:
    metric of a run that is 1 where it ended without a value, as the table's tests do, though a
    number was read of it: such runs count as values unless given; mechanisms: that get emulator
    runs, all that show on it unless given; run: run spec, over that of the calibration.
    """

    metric: str | None = None
    parameters: list[str] | None = Field(None, min_length=1)
    levers: dict[str, Range] | None = None
    held: dict[str, float] = {}
    levels: dict[str, list[float]] = {}
    ended_by: str | None = None
    mechanisms: list[str] | None = None
    run: dict | None = None

    @model_validator(mode="after")
    def _known(self):
        for name, (low, high) in (self.levers or {}).items():
            if name not in SIMULATED or not 0 < low < high:
                raise ValueError(f"levers.{name}: a known lever with 0 < low < high is needed")
        for name, levels in self.levels.items():
            low, high = (self.levers or {}).get(name, (0.0, math.inf))
            if name not in SIMULATED or not all(low <= v <= high and v > 0.0 for v in levels):
                raise ValueError(f"levels.{name}: levels of a lever within its range are needed")
        for name in self.held:
            if name not in SIMULATED or name in (self.levers or {}):
                raise ValueError(f"held.{name}: a known lever that is not among `levers` is needed")
        return self


class Settings(_Part):
    """How a study's conditions are simulated for the diagnosis, and how it decides.

    ranges: least and largest level of a key, in place of those of its factor in the table;
    catalogue: folder with further mechanisms, one file each; gain_runs: of the real engine at each
    left-out setting; minutes: of two cores for all runs of the engine, those that train the
    emulators, refine them, and measure the gain; runs: most of them in all, in place of `minutes`;
    waves: times at most that emulators are refined near the posterior mode; alpha: chance of a
    false alarm over the whole catalogue; batches: jobs that the emulators' runs are divided into;
    experiments: how each that was measured is simulated.
    """

    ranges: dict[str, Range] = {}
    catalogue: str | None = None
    gain_runs: int = Field(3, ge=2, le=50)
    minutes: float | None = Field(None, gt=0)
    runs: int | None = Field(None, ge=30, le=100_000)
    waves: int = Field(2, ge=0, le=2)
    alpha: float = Field(0.05, gt=0, lt=0.5)
    batches: int = Field(8, ge=1, le=64)
    seed: int = Field(7, ge=0)
    experiments: dict[Literal[tuple(QUANTITIES)], Experiment] = {}  # type: ignore[valid-type]  # a tuple of words


RIG = ("particles", "geometry", "numerics")


def study_settings(config: Config) -> Settings:
    """`Settings` of a study: its key `diagnosis`, and what the first test of an experiment says of
    how the diagnosis simulates it. Raises ConfigError."""
    tests, experiments = {}, {}
    for name, test in config.tests.items():
        if test.diagnosis and test.experiment not in tests:
            # its `run` is laid over the test's own
            rig = {key: part for key, part in config.run_of(name).items() if key in RIG}
            run = overlay(rig, test.diagnosis.get("run", {}))
            experiments[test.experiment] = test.diagnosis | {"run": run}
            tests[test.experiment] = name
    try:
        return settings_of(config.diagnosis | {"experiments": experiments})
    except ConfigError as error:
        first, *parts = str(error.key).split(".")
        own = ("diagnosis", first)
        if first == "experiments":
            own = ("tests", tests[parts.pop(0)], "diagnosis")
        key, allowed = ".".join([*own, *parts]), error.allowed
        raise ConfigError(error.reason, key=key, value=error.value, allowed=allowed) from None


def settings_of(data: Mapping[str, Any]) -> Settings:
    """`Settings` from a nested mapping; a null takes its key away. Raises ConfigError."""
    try:
        return Settings.model_validate(_without_nulls(data))
    except ValidationError as error:
        raise ConfigError("is not valid", **first_fault(error)) from None


def _without_nulls(data):
    return {
        k: _without_nulls(v) if isinstance(v, dict) else v for k, v in data.items() if v is not None
    }


def parameters_of(
    settings: Settings, factors_file: str | Path, experiments: Iterable[str]
) -> list[Factor]:
    """Factors calibrated on any of the experiments, in the order of the factors' table. Raises
    ConfigError for a key that no factor sets and for a range that does not ascend."""
    wanted = {p for e in experiments for p in settings.experiments[e].parameters}  # type: ignore[union-attr]  # `setup` fills it in
    factors = read_factors(factors_file)
    known = ", ".join(f"{f.key} ({f.name})" for f in factors)
    for part, keys in (("parameters", wanted), ("ranges", settings.ranges)):
        for key in sorted(set(keys) - {f.key for f in factors}):
            where = {"path": factors_file, "key": part, "value": key}
            raise ConfigError("is set by no factor", **where, allowed=known)  # type: ignore[arg-type]
    chosen = []
    for f in factors:
        low, high = settings.ranges.get(f.key, (f.low, f.high))
        if low >= high:
            raise ConfigError(
                "must ascend", key=f"diagnosis.ranges.{f.key}", value=settings.ranges[f.key]
            )
        if f.key in wanted:
            chosen.append(replace(f, low=low, high=high))
    return chosen


def catalogue_of(settings: Settings, experiments: Iterable[str]) -> dict[str, Mechanism]:
    """{name: Mechanism} of the catalogue and of the settings' own folder. Raises ConfigError for an
    unknown name."""
    known = load_catalogue(folder=settings.catalogue)
    for kind in experiments:
        own, shown = settings.experiments[kind], [n for n in known if kind in known[n].experiments]
        for name in sorted(set(own.mechanisms or ()) - set(shown)):
            key, allowed = f"experiments.{kind}.mechanisms", ", ".join(shown)
            raise ConfigError(
                "is no mechanism that shows on it", key=key, value=name, allowed=allowed
            )
    return known


def check_levers(settings: Settings, measurements: Sequence[Measurement], path: str | Path) -> None:
    """Raise ConfigError for the levers that were set and that the emulators hold at one value, one
    message each."""
    faults = []
    for m in measurements:
        where = {"path": path, "line": m.line}
        levers = settings.experiments[m.experiment].levers
        for name in (n for n in m.levers if n in SIMULATED and n not in levers):  # type: ignore[operator]  # `setup` fills it in
            value, fixed = m.levers[name], _default(settings, m.experiment, name)
            if value != fixed:
                key = f"experiments.{m.experiment}.levers.{name} of the diagnosis' settings"
                allowed = ("empty" if fixed is None else f"empty or {fixed:g}") + f" ({key})"
                more = where | {"column": name, "value": value, "allowed": allowed}
                faults.append(ConfigError("is outside what the emulators cover", **more))
    raise_faults(faults)


def _default(settings, experiment, lever):
    own = settings.experiments[experiment]
    return own.held[lever] if lever in own.held else of_run(own.run, lever)


def of_run(run: Mapping[str, Any], lever: str) -> float | None:
    """Return what a run spec has of a lever where a row leaves it empty; None where it has no
    number."""
    part, key = LEVERS[lever].place  # type: ignore[misc]  # a lever that is simulated
    value = run.get(part, {}).get(key)
    return value if isinstance(value, int | float) else None


def lever_values(
    settings: Settings, experiment: str, levers: Mapping[str, float]
) -> dict[str, float | None]:
    """{lever: value} of the experiment's emulated levers, defaults filled in."""
    return {
        name: levers.get(name, _default(settings, experiment, name))
        for name in settings.experiments[experiment].levers  # type: ignore[union-attr]  # `setup` fills it in
    }


def log_span(low: float, high: float, share: float) -> float:
    """Value at a share in [0, 1] between low and high, in logarithms."""
    return math.exp(math.log(low) + share * (math.log(high) - math.log(low)))
