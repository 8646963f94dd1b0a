"""Run specs as mappings: keys set, parts laid over."""

from collections.abc import Mapping
from typing import Any

SEEDS_A_STAGE = 1000
"""Seeds are disjoint between stages: a run that led to a choice must not judge it as well."""


def point_spec(
    base: Mapping[str, Any], experiment: str, levels: Mapping[str, float | str], seed: int
) -> dict[str, Any]:
    """Run spec as a mapping: `base` with the keys of `levels` {dotted key: number or word} set."""
    return {**with_levels(base, levels), "experiment": experiment, "seed": int(seed)}


def with_levels(base: Mapping[str, Any], levels: Mapping[str, float | str]) -> dict[str, Any]:
    """A copy of the nested mapping `base` with the keys of `levels` {dotted key: value} set."""
    spec = _copy(base)
    for key, value in levels.items():
        part = spec
        *path, last = key.split(".")
        for name in path:
            if part.get(name) is None:
                part[name] = {}
            part = part[name]
        part[last] = value if isinstance(value, str) else float(value)
    return spec


def states(run: Mapping[str, Any], key: str) -> bool:
    """Return whether a run spec (a mapping) has the dotted key."""
    for name in key.split("."):
        if not isinstance(run, dict) or name not in run:
            return False
        run = run[name]
    return True


def overlay(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of the nested mapping `base` with the keys of `changes` laid over it."""
    out = _copy(base)
    for key, value in changes.items():
        out[key] = overlay(out.get(key, {}), value) if isinstance(value, dict) else value
    return out


def numbers_of(data: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """{dotted key: value} of the numbers in a nested mapping."""
    found = {}  # type: dict[str, float]
    for key, value in data.items():
        if isinstance(value, dict):
            found |= numbers_of(value, f"{prefix}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found[f"{prefix}{key}"] = value
    return found


def _copy(data):
    return {k: _copy(v) if isinstance(v, dict) else v for k, v in data.items()}
