"""A factor: its name, the key that it sets in a run spec, and its levels, coded and natural."""

from dataclasses import dataclass
from typing import Any


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

    @property
    def levels(self) -> str:
        """In words."""
        return f"{self.low:g} to {self.high:g}"
