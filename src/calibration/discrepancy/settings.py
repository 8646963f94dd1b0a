"""Settings of the diagnosis and the run spec of a condition."""

import math
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from calibration.config import overlay
from calibration.errors import ConfigError
from calibration.factors import read_factors

PLACE = {
    "particle_diameter_mm": ("particles", "diameter_mm"),
    "particle_count": ("particles", "count"),
    "scale_factor": ("particles", "scale_factor"),
    "discharge_height_mm": ("geometry", "discharge_height_mm"),
    "drop_height_mm": ("geometry", "drop_height_mm"),
    "tilt_rate_deg_s": ("geometry", "tilt_rate_deg_s"),
    "normal_stress_kPa": ("geometry", "normal_stress_kPa"),
}
"""Lever -> its place in a run spec. `output_interval_s` belongs to the measurement, not to the base model."""

Range = Annotated[list[float], Field(min_length=2, max_length=2)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Experiment(_Part):
    """How one experiment is simulated."""

    metric: str = Field(description="metric of a run that the measurement is compared with")
    parameters: list[str] = Field(min_length=1, description="factors that are calibrated on it")
    levers: dict[str, Range] = Field(description="lever: least and largest value of the emulator")
    mechanisms: list[str] | None = Field(
        None, description="mechanisms that get emulator runs; all that show on it unless given"
    )
    run: dict = Field(description="run spec of the experiment, over that of the calibration")

    @model_validator(mode="after")
    def _known(self):
        for name, (low, high) in self.levers.items():
            if name not in PLACE or not 0 < low < high:
                raise ValueError(f"levers.{name}: a known lever with 0 < low < high is needed")
        return self


class Settings(_Part):
    """config/diagnosis.yaml."""

    runs_per_input: int = Field(ge=3, le=100)
    replicates: int = Field(ge=50, le=10000)
    alpha: float = Field(gt=0, lt=0.5)
    batches: int = Field(ge=1, le=64)
    seed: int = Field(ge=0)
    experiments: dict[Literal["heap", "drop", "tilt", "shear"], Experiment]


def read_settings(path, changes=None):
    """`Settings` from YAML with top-level keys of `changes` replaced. Raises ConfigError."""
    try:
        data = yaml.safe_load(Path(path).read_text()) | (changes or {})
        return Settings.model_validate(data)
    except OSError as error:
        raise ConfigError(f"cannot be read ({error.strerror})", path=path) from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(p) for p in first["loc"])
        raise ConfigError(
            "is not valid", path=path, key=key, value=first.get("input"), allowed=first["msg"]
        ) from None


def parameters_of(settings, factors_file, experiments):
    """Factors calibrated on any of the experiments, in the order of the factors' table."""
    wanted = {p for e in experiments for p in settings.experiments[e].parameters}
    factors = read_factors(factors_file)
    unknown = wanted - {f.name for f in factors}
    if unknown:
        raise ConfigError(
            "is no factor", path=factors_file, key="parameters", value=sorted(unknown)[0]
        )
    return [f for f in factors if f.name in wanted]


def check_range(settings, measurements, path):
    """Raise ConfigError for a condition outside the levers' range of the emulators."""
    for m in measurements:
        if m.experiment not in settings.experiments:
            raise ConfigError("has no entry under experiments", path=path, key=m.experiment)
        levers = settings.experiments[m.experiment].levers
        for name, value in m.levers.items():
            if name == "output_interval_s":
                continue
            low, high = levers.get(name, (None, None))
            default = _default(settings, m.experiment, name)
            inside = low * (1 - 1e-9) <= value <= high * (1 + 1e-9) if low else value == default
            if not inside:
                allowed = f"{low:g} to {high:g}" if low else f"{default}, or a range under levers"
                raise ConfigError(
                    f"{m.label} is outside what the emulators cover",
                    path=path,
                    key=f"experiments.{m.experiment}.levers.{name}",
                    value=value,
                    allowed=allowed,
                )


def _default(settings, experiment, lever):
    part, name = PLACE[lever]
    return settings.experiments[experiment].run.get(part, {}).get(name)


def lever_values(settings, experiment, levers):
    """{lever: value} of the experiment's emulated levers, defaults filled in."""
    return {
        name: levers.get(name, _default(settings, experiment, name))
        for name in settings.experiments[experiment].levers
    }


def condition_spec(base, settings, factors, experiment, levers, values, seed):
    """Run spec (a mapping) of a condition: calibration's spec, experiment's, levers, and factor values {name:
    value}."""
    spec = overlay(
        {k: v for k, v in base.items() if k in ("materials", "contacts")},
        settings.experiments[experiment].run,
    )
    spec["laws"] = dict(base.get("laws", {}))
    spec |= {"experiment": experiment, "seed": int(seed)}
    reference = spec["particles"].get("diameter_mm")
    for name, value in levers.items():
        if name in PLACE:
            part, key = PLACE[name]
            spec.setdefault(part, {})[key] = value
    if experiment in ("heap", "shear") and "particle_count" not in levers:
        ratio = reference / spec["particles"]["diameter_mm"]
        spec["particles"]["count"] = max(round(spec["particles"]["count"] * ratio**3), 50)
    for f in factors:
        if f.name in values:
            part = spec
            *path, last = f.key.split(".")
            for name in path:
                part = part.setdefault(name, {})
            part[last] = round(float(values[f.name]), 9)
    return spec


def log_span(low, high, share):
    """Value at a share in [0, 1] between low and high, in logarithms."""
    return math.exp(math.log(low) + share * (math.log(high) - math.log(low)))
