"""A factor: its name, the key that it sets in a run spec, and its levels, coded and natural."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.errors import ConfigError


@dataclass(frozen=True)
class Factor:
    """One factor; low and high are its natural levels at -1 and +1."""

    code: str
    name: str
    key: str
    low: float
    high: float
    description: str = ""

    @property
    def centre(self) -> float:
        """Natural level at 0."""
        return 0.5 * (self.low + self.high)

    @property
    def half_range(self) -> float:
        """Natural units per coded unit."""
        return 0.5 * (self.high - self.low)

    def natural(self, coded: Any) -> Any:
        """Natural level of a coded one; floats or arrays. Rounded to nine digits: levels name
        cached runs."""
        value = self.centre + coded * self.half_range
        return round(value, 9) if isinstance(value, float) else value

    def coded(self, natural: Any) -> Any:
        """Coded level of a natural one."""
        return (natural - self.centre) / self.half_range

    def value(self, level: Any) -> Any:
        """Return what a run spec has at a natural level."""
        return level

    @property
    def levels(self) -> str:
        """In words."""
        return f"{self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Choice(Factor):
    """A factor that has two words and nothing between them, such as two laws of rolling friction.
    Its natural levels in tables are -1 and +1, as its coded ones."""

    words: tuple = ()

    def natural(self, coded: Any) -> Any:
        """The level of a coded one; there is none in the middle, where the first word stands."""
        level = np.where(np.asarray(coded) > 0, 1.0, -1.0)
        return float(level) if level.ndim == 0 else level

    def value(self, level: Any) -> Any:
        """The word of a level, which may be a word already. Raises ConfigError for another."""
        if level in self.words:
            return level
        if level in (-1.0, 1.0):
            return self.words[int(level > 0)]
        raise ConfigError("is no level", key=self.name, value=level, allowed=self.levels)

    @property
    def levels(self) -> str:
        """In words."""
        return " or ".join(self.words)
