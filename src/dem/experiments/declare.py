"""What an experiment says of itself. One file defines `EXPERIMENT`; all tables, schemas and words
are made from it.

These objects give the run spec's schema, the study's metrics, the diagnosis' quantities and levers,
the command's templates and checks, the figures' labels and the reference pages. Nothing else lists
the experiments.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.constants import GRAVITY
from dem.errors import MeasureError, SpecError
from dem.grains.sizes import longest_mm
from dem.units import unit_of

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec


@dataclass(frozen=True)
class Metric:
    """A number that a run gives; the unit is in the name (angle_of_repose_deg).

    meaning: for the reference page. least, most: what is physically possible; a run beyond is
    refused. target: whether a study can be calibrated to it.
    """

    name: str
    meaning: str
    least: float = -np.inf
    most: float = np.inf
    target: bool = True


class Plain:
    """A quantity that is emulated as it is."""

    def forward(self, value: np.ndarray, levers: Mapping[str, Any]) -> np.ndarray:
        """Transformed value; value (n,) in the quantity's unit, levers a mapping of floats or
        arrays (n,)."""
        return np.asarray(value, float)

    def inverse(self, z: np.ndarray, levers: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Value and its derivative by z, each (n,); z (n,) as `forward` gives it."""
        return z, np.ones_like(z)


class Tangent(Plain):
    """An angle [deg] of which the tangent is a friction."""

    def forward(self, value: np.ndarray, levers: Mapping[str, Any]) -> np.ndarray:
        """Tangent of the angle."""
        return np.tan(np.radians(np.minimum(value, 89.0)))

    def inverse(self, z: np.ndarray, levers: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Angle and its derivative."""
        return np.degrees(np.arctan(z)), np.degrees(1.0 / (1.0 + z * z))


@dataclass(frozen=True)
class Share(Plain):
    """A quantity that goes with a lever, as a shear stress with the normal stress."""

    lever: str

    def forward(self, value: np.ndarray, levers: Mapping[str, Any]) -> np.ndarray:
        """Value over the lever."""
        return value / levers[self.lever]

    def inverse(self, z: np.ndarray, levers: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Value and its derivative."""
        slope = levers[self.lever]
        return slope * z, slope + 0.0 * z


LOAD = Share("normal_stress_kPa")  # the scale of a stress that goes with the load


@dataclass(frozen=True)
class LogShare(Plain):
    """A quantity below a lever, as a rebound below the drop height, emulated as the logarithm of
    their ratio."""

    lever: str
    least: float

    def forward(self, value: np.ndarray, levers: Mapping[str, Any]) -> np.ndarray:
        """Logarithm of value over lever; `least` for what has none."""
        return np.log(np.maximum(value / levers[self.lever], self.least))

    def inverse(self, z: np.ndarray, levers: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Value and its derivative."""
        value = levers[self.lever] * np.exp(np.minimum(z, 0.0))
        return value, value


@dataclass(frozen=True)
class Quantity:
    """What a laboratory measures with the experiment: its column's text, unit, limits, and the
    words for a sentence.

    relative: whether its spread goes with its value; that of an angle does not. below: a lever that
    it cannot exceed. scale: how it is transformed for an emulator, so that a nearly linear rest is
    learned.
    """

    name: str
    unit: str
    least: float
    most: float
    words: str
    relative: bool
    below: str | None = None
    scale: Plain = field(default_factory=Plain)


@dataclass(frozen=True)
class Lever:
    """What a laboratory sets: limits, words and unit for a sentence, and its place in a run spec.

    place: (part, key); None where it belongs to the measurement and not to the simulated model.
    needed: whether a measurement must state it.
    """

    least: float
    most: float
    words: str
    unit: str
    place: tuple | None
    needed: bool = False


COUNT = {"particle_count": Lever(1.0, 5e6, "number of grains", "", ("particles", "count"))}
"""The lever of experiments in which grains are poured."""


def lever(
    key: str, least: float, most: float, words: str, needed: bool = False
) -> dict[str, Lever]:
    """{key: `Lever`} of a key of the geometry, whose ending is the unit."""
    return {key: Lever(least, most, words, unit_of(key) or "", ("geometry", key), needed)}


def fall(key: str) -> Callable[[RunSpec], float]:
    """`impact_speed` of a fall in a vacuum from a height of the geometry [mm]."""
    return lambda spec: math.sqrt(2.0 * GRAVITY * 1e-3 * getattr(spec.geometry, key))


def nothing(spec: RunSpec) -> list[str]:
    """No sentence: what `advice` is where nothing is risky."""
    return []


@dataclass(frozen=True)
class Experiment:
    """One virtual experiment. What can be called takes a `RunSpec`, and `run` the
    `dem.run.RunContext` beside it."""

    name: str  # as a run spec's `experiment` has it
    title: str  # for a heading
    geometry: type  # `Part` with the keys of a run spec's `geometry`
    run: Callable  # -> {metric: number}
    metrics: tuple  # `Metric` of each number that a run gives
    defaults: dict = field(default_factory=dict)
    """{part: {key: default}} of a run spec where they differ from the schema's."""
    check: Callable = nothing  # raises SpecError for a geometry that cannot be run
    prepare: Callable = nothing
    """Raises DemError for meshes that the geometry names and that cannot be used."""
    advice: Callable = nothing  # -> sentences about what is valid but risky
    impact_speed: Callable | None = None
    """-> highest speed [m/s] at which grains are expected to hit; None where none falls."""
    least_steps: float = 0.0  # in the shortest contact, below which a run is warned of
    poured: bool = False
    """True where grains are made by `dem.experiments.setup.add_grains`, which may be several bonded
    spheres, pairs or clumps; their runs scatter from seed to seed, as grains never lie twice
    alike."""
    resumes: bool = False  # whether a run that was cut off continues from its checkpoint
    walls: Callable | None = None
    """-> `WallSet` with which it starts, for pictures of runs of other engines, which keep no
    walls; ours keep those of any experiment."""
    heap_plate: Callable | None = None
    """-> radius [m] of the disc that a heap stands on at the end; None without a heap."""
    quantity: Quantity | None = None
    """The reading of a laboratory; None where the diagnosis does not know the experiment."""
    levers: dict = field(default_factory=dict)
    """{column: Lever} beside the grain's diameter and the scale factor, which every experiment has,
    and the number of grains where they are poured."""
    mechanisms: tuple = ()
    """Names of the catalogue's that show on it, beside those that name it themselves."""

    def __post_init__(self):
        if self.poured:
            object.__setattr__(self, "levers", COUNT | self.levers)

    @property
    def targets(self) -> tuple[str, ...]:
        """Names of the metrics that a study can be calibrated to."""
        return tuple(m.name for m in self.metrics if m.target)

    def perform(self, spec: RunSpec, context: RunContext) -> dict[str, Any]:
        """The metrics of a run; None for one that this run has no value of. Raises MeasureError for
        one that is missing or physically impossible."""
        found = self.run(spec, context)
        known = {m.name: m for m in self.metrics}
        names = ", ".join(sorted(found.keys() ^ known.keys()))
        if names:
            reason = "metrics that are declared and those given differ"
            raise MeasureError(f"{self.name}: {names}: {reason}")
        for name, value in found.items():
            least, most = known[name].least, known[name].most
            if value is not None and not least <= value <= most:
                reason = f"{value:g} is not possible; {least:g} to {most:g} is"
                raise MeasureError(f"{self.name}: {name} = {reason}")
        return found


def refuse(key: str, spec: RunSpec, allowed: str) -> None:
    """Raise SpecError for the geometry's key."""
    raise SpecError(f"geometry.{key}", getattr(spec.geometry, key), allowed)


def refuse_narrow(key: str, spec: RunSpec, ratio: float, why: str = "") -> None:
    """Raise SpecError where a length of the geometry [mm] is less than `ratio` of the largest
    grain; why: what the message adds."""
    largest = longest_mm(spec)
    least = ratio * largest
    if getattr(spec.geometry, key) < least:
        allowed = f"at least {least:g}, {ratio:g} of the largest grain ({largest:g} mm)"
        refuse(key, spec, f"{allowed}: {why}" if why else allowed)
