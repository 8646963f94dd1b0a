"""What is physically possible of a factor, by the limits of the run spec's own keys."""

import math
import typing

from pydantic import BaseModel

from dem.spec import GEOMETRY, RunSpec


def physical_range(key: str, experiment: str) -> tuple[float, float]:
    """(low, high) that the dotted `key` of a run spec allows; infinite where it states no limit.

    A limit that is itself not allowed (above 0, below 0.5) is moved in by a billionth of itself or
    of 1.
    """
    model: type[BaseModel] | None = RunSpec
    names = key.split(".")
    if names[0] == "geometry":
        model, names = GEOMETRY[experiment], names[1:]
    for name in names[:-1]:
        model = _model_of(model, name)
    info = model.model_fields.get(names[-1]) if model else None
    low, high = -math.inf, math.inf
    for limit in info.metadata if info else ():
        if hasattr(limit, "ge"):
            low = max(low, limit.ge)
        if hasattr(limit, "gt"):
            low = max(low, limit.gt + 1e-9 * max(abs(limit.gt), 1.0))
        if hasattr(limit, "le"):
            high = min(high, limit.le)
        if hasattr(limit, "lt"):
            high = min(high, limit.lt - 1e-9 * max(abs(limit.lt), 1.0))
    return low, high


def _model_of(model, name):
    """The model of a field, or None where it holds none."""
    info = model.model_fields.get(name) if model else None
    if info is None:
        return None
    kinds = [info.annotation, *typing.get_args(info.annotation)]
    return next((k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)), None)


def inside(centre: float, half: float, low: float, high: float) -> tuple[float, float]:
    """(centre, half) of the levels centre -+ half moved, and where they are too wide narrowed, into
    [low, high]."""
    half = min(half, 0.5 * (high - low))
    return min(max(centre, low + half), high - half), half
