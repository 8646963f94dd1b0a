"""calibrated.yaml: every parameter of the calibrated model with its unit and where it came from."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import yaml

from calibration.chain.study import Study
from calibration.statistics.surface import Surface, parameter_interval
from calibration.study.config import Config, point_spec, states
from calibration.study.factors import Factor
from dem.fingerprint import engine_fingerprint
from dem.spec import RunSpec
from dem.tables import read_table
from dem.units import in_ascii, unit_of

PARTS = ("materials", "contacts", "laws", "law_parameters", "particles", "geometry", "numerics")


def calibrated_entries(
    surface: Surface, region: Sequence[Factor], optimum: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """{key: entry} of the factors that were calibrated; optimum: content of optimum.json."""
    point = [optimum["optimum_coded"][f.code] for f in region]
    entries = {}
    for k, f in enumerate(region):
        error = optimum.get("target_se", 0.0), optimum.get("target_df", float("inf"))
        low, high = parameter_interval(surface, optimum["target"], point, k, 0.05, *error)
        entry = {
            "source": "calibrated",
            "factor": f.name,
            "interval_95_others_held": [f.natural(low), f.natural(high)],
            "region": [f.low, f.high],
            "solution_set": optimum["solution_set"][f.name],
        }
        borders = [side for side, x, at in (("low", low, -1.0), ("high", high, 1.0)) if x == at]
        if borders:
            entry["not_bounded_by_the_data"] = borders
        entries[f.key] = entry
    return entries


FIXED, SPEC, DEFAULT = (
    "fixed by the configuration", "the configuration's run spec", "default of the engine",
)  # fmt: skip
"""Where a parameter's value comes from that was not calibrated, as `source` says it."""


def published_values(tables: Mapping[str, str | None]) -> dict[str, tuple[float, str | None]]:
    """{name: (value, where)} of the numbers that the configuration's `published.tables` print."""
    values = {}
    for path, where in tables.items():
        for _, row in read_table(path).rows:
            try:
                value = float(row["value"]) * (1e6 if row["unit"] == "MPa" else 1.0)
            except ValueError:
                continue  # a list of coefficients
            values[row.get("name") or row["parameter"]] = value, row.get("where") or where
    return values


def known_parameters(
    study: Study, spec: RunSpec, calibrated: Mapping[str, dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    """{key: {value, unit, description, source, ...}} of everything in a `RunSpec` of a study that
    is not None; calibrated: entries of the factors that were calibrated."""
    config, bench, out = study.config, study.bench_levels(), {}
    factors = {f.key: f.name for f in study.factors}
    published, run = published_values(config.published.tables), config.own_run
    for part in PARTS:
        for key, value, note in leaves(getattr(spec, part), RunSpec.model_fields[part], part):
            if value is None:
                continue
            entry = {"value": value}
            if not isinstance(value, str):
                entry["unit"] = in_ascii(unit_of(key))
            if note:
                entry["description"] = note
            in_file = f"{key.rpartition('.')[0]}.file"  # of a clump
            own, name = states(run, key) or states(run, in_file), factors.get(key)
            entry["source"] = SPEC if own else DEFAULT
            if key in calibrated:
                entry |= calibrated[key]
            elif name:
                fixed = {"source": "bench test" if name in bench else FIXED}
                entry |= (fixed if name in config.fixed else {}) | {"factor": name}
            if entry["source"] != "calibrated":
                names = entry.get("factor"), config.published.names.get(key)
                entry |= _printed(value, names, published)
            out[key] = entry
    return out


def _printed(value, names, published):
    """Return what is printed for a parameter under one of its names, as a part of its entry."""
    for name in names:
        for label in (name, f"optimum_{name}"):
            if label in published:
                printed, where = published[label]
                same = np.isclose(printed, value, rtol=1e-9)
                return {"paper": f"{where}: {'the same' if same else f'{printed:g}'}"}
    return {}


def leaves(part: Any, field: Any, prefix: str) -> Iterator[tuple[str, Any, str | None]]:
    """(dotted key, value, description) of every number and word below a part of the spec."""
    fields = getattr(type(part), "model_fields", None)
    if fields is None:
        yield prefix, part, field.description
        return
    for name, below in fields.items():
        yield from leaves(getattr(part, name), below, f"{prefix}.{name}")


class _Dumper(yaml.SafeDumper):
    """Short lists on one line."""


def _float(dumper, data):
    # 1.0e+07 rather than 1e7, which YAML 1.1 would read as a word
    text = f"{data:.9g}"
    if "." not in text:
        text = text.replace("e", ".0e") if "e" in text else f"{text}.0"
    return dumper.represent_scalar("tag:yaml.org,2002:float", text)


_Dumper.add_representer(
    list, lambda own, x: own.represent_sequence("tag:yaml.org,2002:seq", x, flow_style=True)
)
_Dumper.add_representer(float, _float)


def to_yaml(data: Any) -> str:
    """YAML text of plain mappings, lists, numbers and words, in the order given."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120)


def calibrated_spec(
    config: Config, factors: Sequence[Factor], optimum: Mapping[str, float]
) -> dict[str, Any]:
    """Run spec (a mapping) at the calibrated point {factor: level}, with the study's first seed."""
    levels = {**config.fixed, **optimum}
    keys = {f.key: levels[f.name] for f in factors if f.name in levels}
    return point_spec(config.own_run, config.experiment, keys, config.seed)


def engine_of(config: Config) -> str:
    """Return what made the study's runs: this engine by its fingerprint, or another one by its
    version."""
    other = config.own_run.get("engine")
    if not other:
        return engine_fingerprint()
    return " ".join([other["name"], str(other["identity"].get("version", ""))]).strip()
