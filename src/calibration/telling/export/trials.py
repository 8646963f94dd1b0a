"""A heap's angle and profile by two readers that share no line of code, heaps of another code
beside those of the calibrated model, and what heaps that were poured in other codes say of the deck
of another study.

The first reader is the measure of this engine's heaps: lines along the flanks of silhouettes, and
along the mean surface. The second takes grains alone: a straight line along the envelope, the
highest grain in each ring about the axis, and the foot, the radius that holds most of the grains'
volume. A heap that is flat in its lower half and steep at the top has the same flanks as a cone by
the first, and another envelope.

Each quantity has its margin: what a single heap of the calibrated model scatters (two standard
deviations), and no less than the study's margin for an angle, half a grain for a height and a grain
for the foot. It is held where the 90 % interval of the difference of the means lies within the
margin (two one-sided tests at 5 %).

`trials.json` beside this file holds profiles of each rolling law of this engine with a deck's
numbers as they are, and what the codes make of it; `benchmarks.decks` pours them again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from calibration.engines.conversion import Conversion
from calibration.engines.templates import macros
from calibration.files import read_json
from calibration.statistics.validate import compare
from calibration.study.config import overlay
from dem.errors import MeasureError
from dem.grains.sizes import mean_radius
from dem.measure.heap import measure_heap
from dem.spec import RunSpec, parse_spec

RING = 0.5
"""Width of a ring of the envelope, in mean diameters."""
FEWEST = 4
"""Rings that make a line."""
FOOT = 0.9
"""Share of the volume on the plate that lies within the foot."""
READERS = {
    "angle_of_repose_deg": "silhouettes",
    "radial_angle_deg": "mean surface",
    "height_mm": "highest grain",
    "on_plate": "grains on the plate",
    "envelope_angle_deg": "envelope",
    "envelope_height_mm": "envelope on the axis",
    "foot_mm": "foot",
}
"""Quantity of a profile -> what it is read from; the last three are the second reader's."""
SCATTER = 2.0
"""Standard deviations of one heap of the calibrated model that make a margin."""


def profile(
    position: np.ndarray, radius: np.ndarray, velocity: np.ndarray, plate_radius: float
) -> dict[str, float]:
    """{quantity of READERS: value} of a heap at rest: angles in degrees, lengths in mm.

    position, velocity (n, 3) [m], [m/s], radius (n,) [m], plate_radius [m]. Raises MeasureError
    where one of the readers finds no heap.
    """
    first = measure_heap(position, radius, velocity, plate_radius)
    axis = np.hypot(position[:, 0], position[:, 1])
    top = position[:, 2] + radius
    heap = (position[:, 2] > 0.0) & (axis < plate_radius) & (1e3 * top <= first["height_mm"])
    angle, height = envelope(axis[heap], top[heap], float(radius.mean()))
    second = {
        "envelope_angle_deg": angle,
        "envelope_height_mm": 1e3 * height,
        "foot_mm": 1e3 * foot(axis[heap], radius[heap]),
    }
    found = first | second
    return {name: float(found[name]) for name in READERS}


def envelope(axis: np.ndarray, top: np.ndarray, radius: float) -> tuple[float, float]:
    """(angle [deg], height on the axis [m]) of the straight line along the highest grain of each
    ring; the innermost, the rounded top, is left out.

    axis, top (n,): distance from the axis and upper end of each grain [m]; radius: mean [m]. Raises
    MeasureError where too few rings hold a grain."""
    ring = (axis / (RING * 2.0 * radius)).astype(int)
    highest = [np.flatnonzero(ring == k)[np.argmax(top[ring == k])] for k in np.unique(ring) if k]
    if len(highest) < FEWEST:
        raise MeasureError(f"no heap: grains in {len(highest)} rings about the axis")
    slope, height = np.polyfit(axis[highest], top[highest], 1)
    return float(np.degrees(np.arctan(-slope))), float(height)


def foot(axis: np.ndarray, radius: np.ndarray) -> float:
    """Distance from the axis [m] within which the share FOOT of the grains' volume lies. axis,
    radius (n,) [m]."""
    order = np.argsort(axis)
    held = np.cumsum(radius[order] ** 3)
    return float(axis[order][np.searchsorted(held, FOOT * held[-1])])


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
        text: str = macros("calibration.telling.export", "decks").row(self, READERS)
        return text


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
        means = c.simulated_mean, c.simulated_sd, c.measured_mean, c.measured_sd
        low, high = c.equivalence_low, c.equivalence_high
        rows.append(Row(name, *means, c.difference, low, high, allowed))
    return rows


TRIALS = Path(__file__).with_name("trials.json")
ANGLES = ("angle_of_repose_deg", "radial_angle_deg", "envelope_angle_deg")
OWN = "dem"
"""What `trials.json` calls this engine."""


@cache
def trials() -> dict[str, Any]:
    """Content of trials.json: the run spec, what poured the heaps, and {name: trial}: the `changes`
    of its run spec, the conversion of its numbers (`rolling`, null where they are as they are) and
    the profiles {code: [profile, ...]}."""
    return read_json(TRIALS)


def spec_of(name: str) -> RunSpec:
    """`RunSpec` of a trial."""
    kept = trials()
    return parse_spec(overlay(kept["spec"], kept["trials"][name]["changes"]))


def rows_in(code: str, name: str, margin: float) -> list[Row]:
    """A `Row` for each quantity of a trial's heaps in a code and here. margin: of an angle
    [deg]."""
    heaps = trials()["trials"][name]["heaps"]
    return rows_of(spec_of(name), margin, heaps[code], heaps[OWN])


def trial_like(code: str, conversion: Conversion) -> str | None:
    """Name of the trial in a code whose laws and whose conversion are those of a deck; the one of
    equal grains or of several sizes, as the deck's; None where none was made."""
    wanted, several = _laws(conversion.spec, conversion.found), conversion.spec.particles.sizes
    poured = {n: kept for n, kept in trials()["trials"].items() if code in kept["heaps"]}
    specs = {name: spec_of(name) for name in poured}
    found = [n for n in poured if _laws(specs[n], poured[n]["rolling"]) == wanted]
    alike = [n for n in found if bool(specs[n].particles.sizes) == bool(several)]
    return next(iter(alike or found), None)


def _laws(spec, found):
    """Return what decides how a deck's heap compares: rolling law, cohesion, and the law that the
    search chose for other codes."""
    return spec.laws.rolling, spec.laws.cohesion, found["path"] if found else None


def told(code: str, name: str, conversion: Conversion, expected: Mapping[str, Any]) -> str:
    """Sentences for the head of a deck that was not corrected: by how much its angle is off in its
    code, as far as heaps of the same law tell. name: of the code, in words; expected: what the
    calibrated model gives."""
    like, words = trial_like(code, conversion), macros("calibration.telling.export", "decks")
    if like is None:
        return words.told(name, conversion, 0, 0, None, [], "")
    heaps = trials()["trials"][like]["heaps"]
    rows = [r for r in rows_in(code, like, expected["margin"]) if r.quantity in ANGLES]
    there, here = len(heaps[code]), len(heaps[OWN])
    return words.told(name, conversion, there, here, spec_of(like), rows, expected["metric"])
