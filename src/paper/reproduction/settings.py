"""The settings of the reproduction: which studies count or are told beside one another."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from calibration.errors import ConfigError, first_fault
from dem.errors import SpecError
from dem.io.mapping import read_mapping

if TYPE_CHECKING:
    from pathlib import Path


class ReproductionSettings(BaseModel):
    """config/reproduction.yaml."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    beside: dict[str, list[str]] = Field(
        {},
        description="study: names of further studies, which are compared point by point where they "
        "have been run",
    )
    repeats: dict[str, list[str]] = Field(
        {},
        description="study: names of the same study at other seeds, whose screenings count as "
        "repeats of its own where they have been run",
    )
    causes: dict[str, str] = Field(
        {}, description="study: file of the causes of a disagreement in place of the shipped one"
    )


def read_reproduction(path: str | Path) -> ReproductionSettings:
    """`ReproductionSettings` of a YAML file. Raises ConfigError naming file, line and key."""
    try:
        data, lines = read_mapping(path)
    except SpecError as error:
        raise ConfigError(str(error)) from None
    try:
        return ReproductionSettings.model_validate(data)
    except ValidationError as error:
        found = first_fault(error)
        if error.errors()[0]["type"] == "extra_forbidden":
            found["allowed"] = "the keys beside, repeats and causes"
        where = {"path": path, "line": lines.get(found["key"])}
        raise ConfigError("is not valid", **where, **found) from None
