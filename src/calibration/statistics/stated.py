"""A sample of which only the moments are known."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Stated:
    """Measured values of which only mean, standard deviation and number are known; it answers as an
    array of them would."""

    value: float
    sd: float
    n: int

    def mean(self):
        """Their mean."""
        return self.value

    def std(self, ddof=1):
        """Their standard deviation, of ddof 1."""
        return self.sd

    def var(self, ddof=1):
        """Their variance, of ddof 1."""
        return self.sd**2

    def __len__(self):
        return self.n
