"""The free laws that are tried: a slot, the state that it depends on, and how the law enters the
reading.

`restitution` and `friction` multiply, so that the logarithm gains a curve of the state.
`attraction`, `reading` and `drag` add a term. It is a weight of the levers, by which a law of the
simplest kind acts, times a curve of the state. The curve is 1 for the simplest kind. `load` and
`size` are errors of what was set. A state is a power product of the levers.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dem.constants import GRAVITY
from diagnosis.laws.readings import Readings


@dataclass(frozen=True)
class FreeLaw:
    """One slot with one state in one experiment.

    coordinate: levers -> positive state (n,), None for a constant; weight: (levers, centre (n,) of
    logarithms) -> (n,) of an added term, None where the law multiplies; sign: of the added term, 0
    for either.
    same: other (slot, state) that are the same function of the levers of this experiment. odds: log
    prior odds against a law that needs one cause alone.
    """

    experiment: str
    slot: str
    state: tuple
    needs: tuple
    space: str
    coordinate: Callable | None
    weight: Callable | None = None
    sign: int = 0
    same: tuple = ()
    odds: float = 0.0

    @property
    def name(self) -> str:
        """Slot and state in one word."""
        return f"{self.experiment}:{self.slot}({', '.join(self.state)})"


def speed_of(levers: Mapping[str, Any]) -> Any:
    """Impact speed [m/s] of a fall without air."""
    return np.sqrt(2e-3 * GRAVITY * levers["drop_height_mm"])


def _size(levers):
    return levers["particle_diameter_mm"]


def _relative(levers, centre, lever, power):
    """A power of a lever over a reading that is `centre`; 1 in the middle of the plan."""
    value = levers[lever] ** power
    return value / np.nanmean(value)


def _over_height(levers, centre):
    """A length over the height that comes back."""
    height = levers["drop_height_mm"] * np.exp(centre)
    return height.mean() / height


def _over_stress(levers, centre):
    stress = levers["normal_stress_kPa"]
    return stress.mean() / stress


def _froude(levers):
    """Rate squared times diameter over gravity: the tilt while a grain falls by its own size."""
    return 1e-3 * _size(levers) * np.radians(levers[RATE]) ** 2 / GRAVITY


def _inertial(levers):
    """Size over the root of the stress, to which the inertial number of a cell at one rate of shear
    is proportional (GDR MiDi 2004, Eur. Phys. J. E 14:341)."""
    return _size(levers) / np.sqrt(levers[STRESS])


def _film(levers):
    return np.nan_to_num(levers["output_interval_s"], nan=0.0)


def _frames(levers, centre):
    square = _film(levers) ** 2
    return square / max(square.max(), 1e-30) * _over_height(levers, centre)


def _air(levers, centre):
    share = levers["drop_height_mm"] / _size(levers)
    return share / share.mean() * (1.0 + np.exp(centre)) / (1.0 + np.exp(centre)).mean()


HEIGHT, SIZE, RATE, STRESS = (
    "drop_height_mm",
    "particle_diameter_mm",
    "tilt_rate_deg_s",
    "normal_stress_kPa",
)
STATES = {
    "speed": ((HEIGHT,), speed_of),
    "size": ((SIZE,), _size),
    "interval": (("output_interval_s",), _film),
    "rate": ((RATE,), lambda x: x[RATE]),
    "load": ((STRESS,), lambda x: x[STRESS]),
    "Froude number": ((RATE, SIZE), _froude),
    "size over root of load": ((SIZE, STRESS), _inertial),
}
"""{state: (levers that it takes, what it is of them)}."""


def _law(experiment, slot, *state, weight=None, space=None, more=(), same=(), **rest):
    """`FreeLaw` of states, whose product is its coordinate; more: levers that it needs besides;
    same: places that are one function, its own among them or not."""
    known = [STATES[s] for s in state]
    needs = *(lever for levers, _ in known for lever in levers), *more
    space = space or ("linear" if weight else "log")
    coordinate = (lambda x: math.prod(of(x) for _, of in known)) if known else None
    others = tuple(place for place in same if place != (slot, state))
    return FreeLaw(experiment, slot, state, needs, space, coordinate, weight, same=others, **rest)


def _over_size(x, c):
    return _relative(x, c, SIZE, -1.0)


DROP = (
    _law("drop", "restitution", "speed"),
    _law("drop", "restitution", "size"),
    _law("drop", "restitution", "speed", "size"),
    _law("drop", "attraction", "size",
         weight=lambda x, c: _over_height(x, c) * _over_size(x, c), sign=-1),
    _law("drop", "reading", more=(HEIGHT,), weight=_over_height,
         same=(("restitution", ("speed",)),)),
    _law("drop", "reading", "size",
         weight=lambda x, c: _over_height(x, c) * _relative(x, c, SIZE, 1.0)),
    _law("drop", "reading", "interval", weight=_frames, sign=-1),
    _law("drop", "drag", "speed", "size", space="log", weight=_air, sign=-1),
)  # fmt: skip
OF_SIZE = (("friction", ("size",)), ("friction", ("load",)), ("attraction", ("size",)),
           ("mass", ("size",)))  # fmt: skip
"""Of slides of several sizes these are one function."""

INTERCEPT = (("load", ()), ("mass", ()), ("reading", ()), ("wall friction", ()))
"""What adds one stress to all of a shear test: a load or a mass on the lid that was not counted, a
wrong zero of the gauge, the friction of the ring on its own wall."""

TWO_CAUSES = -2.0
"""Log prior odds against a law that needs two causes at once: a pull, and a mass that is carried
along."""

TILT = (
    _law("tilt", "friction", "size", same=OF_SIZE),
    _law("tilt", "friction", "rate", same=(("reading", ("rate",)),)),
    _law("tilt", "attraction", "size", weight=_over_size, sign=1, same=OF_SIZE),
    _law("tilt", "mass", "size", weight=lambda x, c: _relative(x, c, SIZE, -2.0), sign=1,
         same=OF_SIZE, odds=TWO_CAUSES),
    _law("tilt", "reading", "rate", space="angle", sign=1, same=(("friction", ("rate",)),),
         weight=lambda x, c: _relative(x, c, RATE, 2.0 / 3.0)),
    _law("tilt", "reading", "Froude number", space="angle", sign=1,
         weight=lambda x, c: np.cbrt(_froude(x) / _froude(x).mean())),
)  # fmt: skip
SHEAR = (
    _law("shear", "friction", "load"),
    _law("shear", "friction", "size"),
    _law("shear", "friction", "size over root of load"),
    _law("shear", "attraction", more=(STRESS,), weight=_over_stress, sign=1, same=INTERCEPT),
    _law("shear", "attraction", "size", more=(STRESS,), sign=1,
         weight=lambda x, c: _over_stress(x, c) * _over_size(x, c)),
)  # fmt: skip
COEFFICIENT = {"drop": "restitution", "tilt": "friction", "shear": "friction"}
"""Slot of the coefficient of each experiment."""

FAMILY = DROP + TILT + SHEAR
"""Every free law that can be tried."""


def applicable(readings: Readings) -> list[FreeLaw]:
    """The free laws whose levers vary in these readings, and one of each covariate."""
    known = [
        law
        for law in FAMILY
        if law.experiment == readings.experiment
        and all(name in readings.folds for name in law.needs)
    ]
    found = known + [of_covariate(readings.experiment, name) for name in readings.covariates]
    if SIZE in readings.folds:
        found += [with_size(readings.experiment, name) for name in readings.covariates]
    return found


def of_covariate(experiment: str, name: str) -> FreeLaw:
    """The free law of an experiment's coefficient over a covariate.

    The logarithm of its coordinate is that of the covariate where this is positive, else the
    covariate itself over its range."""
    slot = COEFFICIENT[experiment]
    return FreeLaw(experiment, slot, (name,), (name,), "log", lambda x: _positive(x[name]))


TOGETHER = -3.0
"""Log prior odds against a column that acts with the size, beside one that acts alone: with sizes
alike it is one."""


def with_size(experiment: str, name: str) -> FreeLaw:
    """The free law of a covariate whose effect on the coefficient changes with the grains' size: a
    share of the covariate (`share_of`) times a curve of the size."""
    return FreeLaw(
        experiment, COEFFICIENT[experiment], (name, "size"), (name, SIZE), "log", _size,
        lambda x, c: share_of(x[name]), odds=TOGETHER,
    )  # fmt: skip


def share_of(value: np.ndarray) -> np.ndarray:
    """A covariate (n,) over its largest value; one that falls below zero about its mean, over half
    its range."""
    if (value >= 0.0).all():
        return value / value.max()
    return (value - value.mean()) / (0.5 * np.ptp(value))


def _positive(value):
    if (value > 0.0).all():
        return value
    return np.exp(2.0 * (value - value.mean()) / np.ptp(value))


def natural(law: FreeLaw, levers: Mapping[str, np.ndarray], log: np.ndarray) -> np.ndarray:
    """The state of a law (k,) at logarithms of its coordinate (k,): a column that holds zero or
    less as it was recorded."""
    own = levers.get(law.state[0]) if len(law.state) == 1 else None
    if own is None or (own > 0.0).all():
        return np.exp(log)
    return own.mean() + 0.5 * np.ptp(own) * log


def coordinates(readings: Readings) -> dict[str, np.ndarray]:
    """{name: (n,)} of levers and covariates, of which laws take their states."""
    return readings.levers | readings.covariates


def scaled(law: FreeLaw, levers: Mapping[str, np.ndarray]) -> tuple[np.ndarray, float, float]:
    """Coordinate (n,) of a law's state, its logarithm over the plan from -1 to 1, with middle and
    half range."""
    value = np.log(np.maximum(law.coordinate(levers), 1e-12))  # type: ignore[misc]
    low, high = value.min(), value.max()
    return (
        2.0 * (value - low) / max(high - low, 1e-12) - 1.0,
        0.5 * (low + high),
        0.5 * (high - low),
    )


def added(space: str, term: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return what a term adds to the logarithms of readings about `centre`: log, the term itself;
    linear, it is a share of the reading; angle, a share of the sliding angle. term and centre: (n,)
    or (k, n)."""
    if space == "log":
        return term
    if space == "linear":
        return np.log1p(term)
    angle = np.arctan(np.exp(centre))
    return np.log(np.tan(np.clip(angle * (1.0 + term), 1e-6, 1.56))) - centre
