"""How the rates simulate tests: as the salt's study does, or as settings.yaml says."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from calibration.study.config import Config, overlay
from diagnosis.settings import Settings, settings_of, study_settings

ROOT = Path(__file__).parents[2]


def _salt():
    text = (ROOT / "config/config.yaml").read_text()
    return Config.model_validate(yaml.safe_load(text))


def salt_heap() -> dict[str, Any]:
    """Run spec of the salt's heap, without a seed."""
    config = _salt()
    return config.own_run | {"experiment": config.experiment}


def salt_settings(changes: Mapping[str, Any] | None = None) -> Settings:
    """`Settings` of the salt's study, `changes` laid over them; a null takes its key away."""
    own = study_settings(_salt()).model_dump(exclude_none=True)
    return settings_of(overlay(own, changes or {}))


def rate_settings(changes: Mapping[str, Any] | None = None) -> Settings:
    """`Settings` of settings.yaml, `changes` laid over them."""
    text = (ROOT / "benchmarks/rates/settings.yaml").read_text()
    return settings_of(overlay(yaml.safe_load(text), changes or {}))
