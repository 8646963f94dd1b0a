"""A sample of which only the moments are known."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Stated:
    """Measured values of which only mean, standard deviation and number are known; it answers as an
    array of them would."""

    value: float
    sd: float
    n: int

    def mean(self) -> float:
        """Their mean."""
        return self.value

    def std(self, ddof: int = 1) -> float:
        """Their standard deviation, of ddof 1."""
        return self.sd

    def var(self, ddof: int = 1) -> float:
        """Their variance, of ddof 1."""
        return self.sd**2

    def __len__(self) -> int:
        return self.n
