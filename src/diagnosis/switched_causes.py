"""Causes of a disagreement that are switched on in runs of the engine: a rig, a numerical setting,
parameters that were exchanged, another metric as the reading.

Each is run at the parameters of every one of another code's runs, so that its values stand beside
theirs as our own do (`diagnosis.other_code`).
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from calibration.errors import ConfigError, first_fault
from calibration.intake.measurements import Measurement
from calibration.runs.simulated import named
from dem.errors import SpecError
from dem.io.mapping import read_mapping
from diagnosis.other_code import Cause


class Switched(BaseModel):
    """What is switched on for one cause, once or at several strengths."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: Literal["rig", "numerical", "parameters", "reading"]
    run: dict = Field({}, description="keys laid over the run spec")
    at: dict[float, dict] = Field({}, description="strength: keys laid over the run spec for it")
    unit: str = Field("", description="unit of the strengths")
    exchange: tuple[str, str] | None = Field(
        None, description="two factors whose values change places"
    )
    metric: str | None = Field(None, description="metric that is read in place of the experiment's")
    scatter: str | None = Field(
        None, description="metric of the standard deviation between trials, where it is the cause's"
    )
    trials: int = Field(1, ge=1, description="trials that each of their values is the mean of")
    seeds: int = Field(1, ge=1, le=100, description="runs at each row, whose mean counts")
    scatter_of: str | None = Field(
        None,
        description="name of a study in the same rig: its validation tells by how much runs of "
        "this cause differ from seed to seed",
    )
    tables: list[str] | None = Field(None, description="tables it is tried on; all unless given")

    @model_validator(mode="after")
    def _one_way(self):
        if bool(self.run) + bool(self.at) + bool(self.exchange) + bool(self.metric) != 1:
            raise ValueError("one of run, at, exchange and metric is needed")
        return self

    @property
    def overlays(self) -> dict[float, dict]:
        """{strength: keys laid over the run spec}; the strength of what has none is 1."""
        return self.at or {1.0: self.run}

    def values(self, known: dict[str, float]) -> dict[str, float]:
        """The factors' values {name: value} of one of their runs as this cause has them."""
        if not self.exchange:
            return known
        a, b = self.exchange
        return known | {a: known[b], b: known[a]}


def read_switched(path: str | Path) -> dict[str, dict[str, Switched]]:
    """{experiment: {words: `Switched`}} of a YAML file. Raises ConfigError naming file and key."""
    try:
        data, lines = read_mapping(path)
    except SpecError as error:
        raise ConfigError(str(error)) from None
    out: dict[str, dict[str, Switched]] = {}
    for experiment, causes in data.items():
        out[experiment] = {}
        for name, given in (causes or {}).items():
            try:
                out[experiment][name] = Switched.model_validate(given)
            except ValidationError as error:
                found = first_fault(error, experiment, name)
                line = lines.get(found["key"]) or lines.get(f"{experiment}.{name}")
                raise ConfigError("is not valid", path=path, line=line, **found) from None
    return out


def plan(
    table: str,
    runs: Sequence[Measurement],
    causes: Mapping[str, Switched],
    spec_of: Callable[[Measurement, dict[str, float], dict], dict[str, Any]],
) -> tuple[list[dict[str, Any]], dict[str, dict[str, Any]]]:
    """Rows [{table, cause, strength, replicate, run}] in the order of the table's runs, all of them
    for each replicate, and {run id: spec}. Replicates have the seeds from the study's own on.

    spec_of: (`Measurement`, {factor: value}, keys laid over) -> run spec (a mapping)."""
    rows: list[dict[str, Any]] = []
    specs: dict[str, dict[str, Any]] = {}
    for name, cause in causes.items():
        if cause.tables is not None and table not in cause.tables:
            continue
        for strength, changes in cause.overlays.items():
            first = [spec_of(m, cause.values(dict(m.known)), changes) for m in runs]
            for replicate in range(cause.seeds):
                own = [spec | {"seed": spec["seed"] + replicate} for spec in first]
                ids = [next(iter(named([spec]))) for spec in own]
                specs |= dict(zip(ids, own, strict=True))
                row = {"table": table, "cause": name, "strength": strength, "replicate": replicate}
                rows += [row | {"run": i} for i in ids]
    return rows, specs


def tried(
    rows: Sequence[dict[str, Any]],
    causes: Mapping[str, Switched],
    metrics: Mapping[str, dict[str, float] | None],
    metric: str,
    spreads: Mapping[str, float] | None = None,
) -> tuple[list[Cause], dict[str, np.ndarray]]:
    """([`diagnosis.other_code.Cause`], {cause: values (k, n)}) of one table's rows. spreads:
    {cause: standard deviation of the difference of two runs under it}, where known.

    A cause that leaves runs without a value has nothing to compare there and is told apart: its
    values have NaN there."""
    found, without = [], {}
    for name in dict.fromkeys(r["cause"] for r in rows):
        cause, own = causes[name], [r for r in rows if r["cause"] == name]
        table = _table(own, metrics, cause.metric or metric)
        if np.isnan(table).any():
            without[name] = table
            continue
        noise = _table(own, metrics, cause.scatter) if cause.scatter else np.zeros(table.shape)
        strengths = np.array(list(dict.fromkeys(r["strength"] for r in own)), float)
        found.append(
            Cause(name, cause.kind, cause.unit, strengths, table, noise / np.sqrt(cause.trials),
            (spreads or {}).get(name))
        )  # fmt: skip
    return found, without


def _table(rows, metrics, key):
    """(k, n) values of a metric, a row a strength, means over the replicates that have one; NaN
    where none has."""
    values = {}
    for r in rows:
        own = values.setdefault(r["strength"], {}).setdefault(r.get("replicate", 0), [])
        own.append((metrics[r["run"]] or {}).get(key, np.nan))
    table = np.array([list(own.values()) for own in values.values()], float)
    has = np.isfinite(table)
    total = np.where(has, table, 0.0).sum(1)
    return np.where(has.any(1), total / np.maximum(has.sum(1), 1), np.nan)
