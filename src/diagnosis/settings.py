"""Settings of the diagnosis and the run spec of a condition."""

import math
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from calibration.config import overlay
from calibration.errors import ConfigError
from calibration.factors import read_factors
from calibration.measurements import raise_faults
from calibration.quantities import LEVERS, QUANTITIES
from dem.errors import SpecError
from dem.io.mapping import read_mapping
from diagnosis.catalogue import load_catalogue

BASE = "base"
"""The model without any mechanism, where one is named."""

SIMULATED = {name for name, lever in LEVERS.items() if lever.place}

Range = Annotated[list[float], Field(min_length=2, max_length=2)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Experiment(_Part):
    """How one experiment is simulated."""

    metric: str = Field(description="metric of a run that the measurement is compared with")
    parameters: list[str] = Field(
        min_length=1, description="keys of the run spec whose factors are calibrated on it"
    )
    levers: dict[str, Range] = Field(description="lever: least and largest value of the emulator")
    mechanisms: list[str] | None = Field(
        None, description="mechanisms that get emulator runs; all that show on it unless given"
    )
    runs_per_input: int | None = Field(
        None, ge=3, le=100, description="in place of the number for all experiments"
    )
    denser: dict[str, Annotated[int, Field(ge=3, le=200)]] = Field(
        {}, description="mechanism: runs per input in place of that of the experiment"
    )
    hypercubes: dict[str, Annotated[int, Field(ge=1, le=20)]] = Field(
        {}, description="mechanism or `base`: Latin hypercubes of so many runs, in place of one"
    )
    repeated: dict[str, Annotated[int, Field(ge=1, le=20)]] = Field(
        {}, description="mechanism or `base`: runs at each point, of other seeds, in place of one"
    )
    run: dict = Field(description="run spec of the experiment, over that of the calibration")

    @model_validator(mode="after")
    def _known(self):
        for name, (low, high) in self.levers.items():
            if name not in SIMULATED or not 0 < low < high:
                raise ValueError(f"levers.{name}: a known lever with 0 < low < high is needed")
        if not self.levers:
            raise ValueError("levers: an emulator needs one lever at least")
        return self


class Settings(_Part):
    """config/diagnosis.yaml."""

    ranges: dict[str, Range] = Field(
        {}, description="key: least and largest level, in place of those of its factor in the table"
    )
    catalogue: str | None = Field(None, description="folder with further mechanisms, one file each")
    gain_runs: int = Field(
        3, ge=2, le=50, description="runs of the real engine at each left-out setting"
    )

    runs_per_input: int = Field(ge=3, le=100)
    replicates: int = Field(ge=50, le=10000)
    alpha: float = Field(gt=0, lt=0.5)
    batches: int = Field(ge=1, le=64)
    seed: int = Field(ge=0)
    experiments: dict[Literal[tuple(QUANTITIES)], Experiment]


def read_settings(path, changes=None):
    """`Settings` from YAML with the nested mapping `changes` laid over it; a null takes its key
    away. Raises ConfigError."""
    try:
        data, _ = read_mapping(path)
        if not isinstance(data, dict):
            raise ConfigError("is no mapping", path=path, allowed="a YAML mapping of keys")
        return Settings.model_validate(_without_nulls(overlay(data, changes or {})))
    except SpecError as error:
        raise ConfigError(str(error)) from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(p) for p in first["loc"])
        raise ConfigError(
            "is not valid", path=path, key=key, value=first.get("input"), allowed=first["msg"]
        ) from None


def _without_nulls(data):
    return {
        k: _without_nulls(v) if isinstance(v, dict) else v for k, v in data.items() if v is not None
    }


def parameters_of(settings, factors_file, experiments):
    """Factors calibrated on any of the experiments, in the order of the factors' table."""
    wanted = {p for e in experiments for p in settings.experiments[e].parameters}
    factors = read_factors(factors_file)
    known = ", ".join(f"{f.key} ({f.name})" for f in factors)
    for part, keys in (("parameters", wanted), ("ranges", settings.ranges)):
        for key in sorted(set(keys) - {f.key for f in factors}):
            where = {"path": factors_file, "key": part, "value": key}
            raise ConfigError("is set by no factor", **where, allowed=known)
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


def catalogue_of(settings, experiments):
    """{name: Mechanism} of the catalogue and of the settings' own folder. Raises ConfigError for an
    unknown name."""
    known = load_catalogue(folder=settings.catalogue)
    for kind in experiments:
        own, shown = settings.experiments[kind], [n for n in known if kind in known[n].experiments]
        named = {
            "mechanisms": own.mechanisms or (),
            "denser": own.denser,
            "hypercubes": own.hypercubes.keys() - {BASE},
            "repeated": own.repeated.keys() - {BASE},
        }
        for part, names in named.items():
            for name in sorted(set(names) - set(shown)):
                key, allowed = f"experiments.{kind}.{part}", ", ".join(shown)
                raise ConfigError(
                    "is no mechanism that shows on it", key=key, value=name, allowed=allowed
                )
    return known


def check_range(settings, measurements, path):
    """Raise ConfigError for the conditions outside what the emulators cover, one message each."""
    faults = []
    for m in measurements:
        where = {"path": path, "line": m.line}
        if m.experiment not in settings.experiments:
            allowed = ", ".join(settings.experiments)
            where |= {"column": "experiment", "value": m.experiment, "allowed": allowed}
            faults.append(ConfigError("has no entry in the diagnosis' settings", **where))
            continue
        levers = settings.experiments[m.experiment].levers
        for name, value in m.levers.items():
            if name not in SIMULATED:
                continue
            if name in levers:
                low, high = levers[name]
                inside = low * (1 - 1e-9) <= value <= high * (1 + 1e-9)
                allowed = f"{low:g} to {high:g}"
            else:
                fixed = _default(settings, m.experiment, name)
                inside = value == fixed
                allowed = "empty" if fixed is None else f"empty or {fixed:g}"
            if not inside:
                key = f"experiments.{m.experiment}.levers.{name} of the diagnosis' settings"
                more = where | {"column": name, "value": value, "allowed": f"{allowed} ({key})"}
                faults.append(ConfigError("is outside what the emulators cover", **more))
    raise_faults(faults)


def _default(settings, experiment, lever):
    part, name = LEVERS[lever].place
    return settings.experiments[experiment].run.get(part, {}).get(name)


def lever_values(settings, experiment, levers):
    """{lever: value} of the experiment's emulated levers, defaults filled in."""
    return {
        name: levers.get(name, _default(settings, experiment, name))
        for name in settings.experiments[experiment].levers
    }


def log_span(low, high, share):
    """Value at a share in [0, 1] between low and high, in logarithms."""
    return math.exp(math.log(low) + share * (math.log(high) - math.log(low)))
