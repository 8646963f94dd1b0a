"""Free laws of bulk tests: a coefficient that changes along a lever.

Within one run a lever has one value. So a run under such a law is a run of the base model with
another coefficient, which the base model's emulator predicts without a further run; and the engine
runs it without a curve. Each law is a straight line of a coefficient over the logarithm of a lever;
its strength is the change from the least to the largest value of the lever.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.figures import parameter_words
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS
from calibration.study.config.specs import numbers_of, with_levels
from calibration.study.factors import Factor
from dem.units import without_unit
from diagnosis.catalogue import Mechanism, Strength
from diagnosis.design import WIDENED, inputs_of
from diagnosis.settings import BASE, Settings

LEAST_LEVELS = 3
"""Levels of a lever along which a law is tried: two are no curve."""

STATES = {"particle_diameter_mm": "size", "normal_stress_kPa": "load"}
"""Levers that are a state of the contact by another word."""


@dataclass(frozen=True)
class AlongLever:
    """Emulator of a law: what a run of the base model tells with the coefficient's input, `column`,
    moved by the strength times the place along the lever, whose input is `lever`.

    The place, -1/2 to 1/2 over the lever's range, is start + slope times the lever's input. The
    last of the inputs x (k, d + 1) is the coded strength."""

    base: Any
    column: int
    lever: int
    start: float
    slope: float

    def moved(self, x: np.ndarray) -> np.ndarray:
        """Inputs (k, d) of the base model."""
        out = x[:, :-1].copy()
        place = self.start + self.slope * x[:, self.lever]
        out[:, self.column] += (2.0 * x[:, -1] - 1.0) / WIDENED * place
        return out

    def predict(self, x: np.ndarray, error: bool = True) -> Any:
        """As `Response.predict`."""
        return self.base.predict(self.moved(x), error)

    def correlation(self, x: np.ndarray) -> Any:
        """As `Response.correlation`."""
        return self.base.correlation(self.moved(x))


def lever_laws(
    settings: Settings, factors: Sequence[Factor], measurements: Sequence[Measurement]
) -> dict[str, Mechanism]:
    """{name: `Mechanism`} of the laws that are tried: of each calibrated coefficient along each
    emulated lever that was measured at `LEAST_LEVELS` levels or more in an experiment of both."""
    found = {}
    for factor in factors:
        for lever in LEVERS:
            kinds = [
                kind
                for kind in dict.fromkeys(m.experiment for m in measurements)
                if factor.key in settings.experiments[kind].parameters  # type: ignore[operator]  # `setup` fills it in
                and lever in settings.experiments[kind].levers  # type: ignore[operator]  # `setup` fills it in
                and len({m.levers.get(lever) for m in measurements if m.experiment == kind})
                >= LEAST_LEVELS
            ]
            if kinds:
                law = _law(settings, factor, lever, kinds)
                found[law.name] = law
    return found


def with_laws(
    emulators: Mapping[tuple[str, str], Any],
    settings: Settings,
    factors: Sequence[Factor],
    laws: Mapping[str, Mechanism],
) -> dict[tuple[str, str], Any]:
    """The emulators {(experiment, mechanism): ...} with those of `lever_laws` beside them."""
    out = dict(emulators)
    for law in laws.values():
        coefficient, lever = law.changes  # type: ignore[misc]
        factor = next(f for f in factors if f.key == coefficient)
        low, high = _range(settings, lever, law.experiments)
        span = math.log(high / low)
        for kind in law.experiments:
            if (kind, BASE) in emulators:
                names = inputs_of(settings, factors, kind, BASE)
                own_low, own_high = settings.experiments[kind].levers[lever]  # type: ignore[index]  # `setup` fills it in
                start = math.log(own_low / low) / span - 0.5
                slope = math.log(own_high / own_low) / span
                at = names.index(factor.name), names.index(lever)
                out[kind, law.name] = AlongLever(emulators[kind, BASE], *at, start, slope)
    return out


def _range(settings, lever, kinds):
    """Least and largest value of a lever in all of the experiments."""
    ranges = [settings.experiments[k].levers[lever] for k in kinds]
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def _law(settings, factor, lever, kinds):
    """The law of a factor's coefficient along a lever."""
    low, high = _range(settings, lever, kinds)
    span = factor.high - factor.low
    last = factor.key.rpartition(".")[2]
    short = without_unit(lever)

    def apply(spec, strength):
        """The coefficient of the run's own value of the lever."""
        part, key = LEVERS[lever].place
        value = spec[part][key]
        place = math.log(value / low) / math.log(high / low) - 0.5
        middle = numbers_of(spec).get(factor.key, factor.centre)
        most = 1.0 if last == "restitution" else math.inf
        return with_levels(spec, {factor.key: min(max(middle + strength * place, 0.0), most)})

    words = parameter_words(factor.key)
    return Mechanism(
        name=f"{factor.name}_over_{short}",
        description=f"the {words} changes along the {LEVERS[lever].words}",
        source="a free law",
        experiments=tuple(kinds),
        strength=Strength(
            f"change over {low:g} to {high:g} {LEVERS[lever].unit}".rstrip(),
            "1",
            -span,
            span,
            off=0.0,
        ),
        apply=apply,
        law=(last, (STATES.get(lever, short),)),
        changes=(factor.key, lever),
    )
