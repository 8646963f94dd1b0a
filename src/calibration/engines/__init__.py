"""Engines that can make a study's runs: our own, another DEM code, any command, or a table that is
filled in.

A configuration names its engine (`engine: liggghts`, or a mapping with `name` and the engine's
settings). Without a name our own engine makes the runs. Each other engine is one file here that
declares itself as `ENGINE`.

A run's numbers depend on the program and its version as well. Both stand in the spec under
`engine`, and so in the run's name: two engines never share a cached run.
"""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from calibration.digests import adapter_digest
from calibration.errors import ConfigError, first_fault
from dem.errors import DemError
from dem.io.files import write_arrays
from dem.results import OTHER, STATE
from dem.run import run
from dem.spec import RunSpec, parse_spec

OWN = "dem"
NO_GRAINS = {k: np.empty((0, 3)) for k in ("position", "velocity", "spin")} | {
    k: np.empty(0) for k in ("radius", "tag", "grain")
}
"""The last state where an engine tells none."""


class EngineError(DemError):
    """Another engine that is missing, cannot represent a spec, failed, or left no usable
    numbers."""


class Settings(BaseModel):
    """What every engine can be told."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    timeout_s: float = Field(3600.0, gt=0, description="a run that takes longer has failed [s]")


@dataclass(frozen=True)
class Engine:
    """Another engine, declared in its own file."""

    name: str
    settings: type[Settings]
    """Schema of the settings."""
    experiments: tuple[str, ...]
    """Experiments that it can run; empty where it can run any."""
    identity: Callable
    """identity(settings) -> mapping of what the numbers depend on beyond spec and settings. Raises
    EngineError where the program is missing."""
    simulate: Callable
    """simulate(spec, folder, entry) -> (metrics, state): runs a `RunSpec` in `folder`; state:
    arrays of the grains at the
    end (position, velocity, spin (n, 3), radius (n,)) or an empty mapping. Raises EngineError."""
    refuse: Callable = lambda spec: None
    """refuse(spec): raises EngineError, by name, for what this engine cannot represent of a
    `RunSpec`; of any program and of a table that is the user's own affair."""
    changed: Callable | None = None
    """changed(result, name) -> a sentence where what a kept result was read from has changed, else
    None."""


@cache
def engines() -> dict[str, Engine]:
    """{name: `Engine`} of all files of this package that declare one."""
    modules = (
        importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)
    )
    return {m.ENGINE.name: m.ENGINE for m in modules if hasattr(m, "ENGINE")}


def entry_of(chosen: str | Mapping[str, Any]) -> dict[str, Any] | None:
    """Return what a configuration's `engine` adds to each of its run specs: None for our own, else
    {name, identity, settings}.

    Raises ConfigError for an unknown engine, a wrong setting, or a program that is not installed.
    """
    chosen = {"name": chosen} if isinstance(chosen, str) else dict(chosen)
    name = chosen.pop("name", None)
    if name == OWN and not chosen:
        return None
    if name not in engines():
        known = ", ".join((OWN, *sorted(engines())))
        raise ConfigError("is no engine", key="engine.name", value=name, allowed=known)
    engine = engines()[name]
    try:
        settings = engine.settings.model_validate(chosen)
    except ValidationError as error:
        raise ConfigError("is not valid", **first_fault(error, "engine")) from None
    try:
        identity = _identity(engine, settings)
    except EngineError as error:
        raise ConfigError(str(error), key="engine", value=name) from None
    return {"name": name, "identity": identity, "settings": settings.model_dump(mode="json")}


def _identity(engine, settings):
    """Return what a run's numbers depend on beyond its spec: what the engine says, and the code
    that writes its input and reads its output, where that is ours."""
    found = engine.identity(settings)
    if not engine.experiments:
        return found
    return found | {"adapter": adapter_digest(Path(__file__).parent)}


def check(spec: RunSpec) -> None:
    """Refuse a `RunSpec` that its engine cannot represent. Raises EngineError."""
    if spec.engine is None:
        return
    engine = engines()[spec.engine.name]
    if engine.experiments and spec.experiment not in engine.experiments:
        raise EngineError(
            f"{engine.name} cannot run the experiment {spec.experiment}; it can: "
            f"{', '.join(engine.experiments)}"
        )
    engine.refuse(spec)


def make(
    spec: Mapping[str, Any],
    out: str | Path,
    progress: Callable[..., object] | None = None,
    *,
    again: bool = True,
) -> dict[str, Any]:
    """Make the run of a planned spec (a mapping) in folder `out` with its engine, as `dem.run.run`
    does with ours."""
    return run(parse_spec(spec), out, progress, again=again, maker=_simulate)


def _simulate(spec, context):
    """Metrics of a spec that names another engine; its last state is kept as ours is."""
    engine, entry = engines()[spec.engine.name], spec.engine
    check(spec)
    found = _identity(engine, engine.settings.model_validate(entry.settings))
    if found != entry.identity:
        raise EngineError(
            f"{engine.name}: this run was planned with {entry.identity}, here is {found}; plan the "
            f"stage again"
        )
    metrics, state = engine.simulate(spec, context.out, entry.model_dump())
    write_arrays(context.out / STATE, NO_GRAINS | state)
    return metrics


def changed(made_by: str, name: str, store: Any) -> str | None:
    """A sentence where the numbers behind a result of another engine are others now, else None."""
    engine = engines().get(made_by.removeprefix(OTHER))
    return engine.changed(store.result(name), name) if engine and engine.changed else None
