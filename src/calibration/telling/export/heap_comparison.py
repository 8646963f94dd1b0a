"""Heaps of another code beside those of the calibrated model: differences, margins, verdicts.

Each quantity has its margin: what a single heap of the calibrated model scatters (two standard
deviations), and no less than the study's margin for an angle, half a grain for a height and a grain
for the foot. It is held where the 90 % interval of the difference of the means lies within the
margin (two one-sided tests at 5 %).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calibration.statistics.validate import compare
from calibration.telling.export.heap_profile import READERS
from dem.grains import mean_radius

if TYPE_CHECKING:
    from dem.spec import RunSpec


SCATTER = 2.0
"""Standard deviations of one heap of the calibrated model that make a margin."""


@dataclass(frozen=True)
class Row:
    """A quantity of READERS in the target code and here."""

    quantity: str
    there: float
    there_sd: float
    here: float
    here_sd: float
    difference: float
    low: float
    high: float
    margin: float

    @property
    def verdict(self) -> str:
        """`holds`, `misses`, or `open` where the interval reaches beyond the margin."""
        if max(-self.low, self.high) < self.margin:
            return "holds"
        return "misses" if abs(self.difference) > self.margin else "open"

    @property
    def unit(self) -> str:
        """Of the quantity: the end of its name; empty for a number of grains."""
        end = self.quantity.rsplit("_", 1)[-1]
        return end if end in ("deg", "mm") else ""

    @property
    def told(self) -> str:
        """A sentence: what differs, by how much, and what is allowed."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{READERS[self.quantity]} {self.difference:+.2f}{unit} (90 %: {self.low:+.2f} to "
            f"{self.high:+.2f}; margin {self.margin:.2f})"
        )


def margins_of(
    spec: RunSpec, margin: float, here: Sequence[Mapping[str, float]]
) -> dict[str, float]:
    """{quantity: margin} from the scatter of heaps of the calibrated model; margin: the study's for
    an angle [deg]."""
    grain = 2e3 * mean_radius(spec)
    least = {name: margin for name in READERS if name.endswith("_deg")}
    least |= {"foot_mm": grain, "on_plate": 0.02 * spec.particles.count}
    sd = {name: float(np.std([h[name] for h in here], ddof=1)) for name in READERS}
    return {name: max(least.get(name, 0.5 * grain), SCATTER * sd[name]) for name in READERS}


def rows_of(
    spec: RunSpec,
    margin: float,
    there: Sequence[Mapping[str, float]],
    here: Sequence[Mapping[str, float]],
) -> list[Row]:
    """A `Row` for each quantity of heaps in the target code and here, profiles of heaps of `spec`;
    margin as `margins_of` takes it."""
    rows = []
    for name, allowed in margins_of(spec, margin, here).items():
        c = compare([[h[name] for h in there]], [h[name] for h in here], allowed)
        low, high = c.equivalence_low, c.equivalence_high
        row = Row(
            name, c.simulated_mean, c.simulated_sd, c.measured_mean, c.measured_sd, c.difference,
            low, high, allowed,
        )  # fmt: skip
        rows.append(row)
    return rows
