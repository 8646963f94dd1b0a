"""What every part of a run spec is made of: a frozen pydantic model that takes no unknown key."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, field_validator
from pydantic_core import PydanticCustomError


class Part(BaseModel):
    """A mapping of a run spec: unknown keys, infinities and booleans in place of numbers are
    refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_boolean(cls, value):
        """YAML's yes, no, on, off would otherwise pass as 1 and 0."""
        if isinstance(value, bool):
            raise PydanticCustomError("boolean", "a number or a word, not true or false")
        return value


def field(default: Any, description: str, **limits: Any) -> Any:
    """A key with its default, its meaning and pydantic's limits (gt, ge, lt, le)."""
    return Field(default, description=description, **limits)


def mesh_field(description: str) -> Any:
    """A key that names a STL file in place of a rig's own walls. A spec without one is written, and
    named, as if there were no such key."""
    return Field(None, description=description, exclude_if=lambda value: value is None)
