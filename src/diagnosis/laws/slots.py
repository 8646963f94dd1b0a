"""The free laws that are tried: a slot, the state that it depends on, and how the law enters the
reading.

`restitution` and `friction` multiply, so that the logarithm gains a curve of the state.
`attraction`, `reading` and `drag` add a term. It is a weight of the levers, by which a law of the
simplest kind acts, times a curve of the state. The curve is 1 for the simplest kind. `load` and
`size` are errors of what was set. A state is a power product of the levers.

A free law has named forms with one number each. Those that multiply are 1 at the middle of the
plan's states (u = state over that), so that level and shape do not trade against each other. Forms
that add are the weight of their slot times a power of u. Sources: a viscous contact 1 - e ~ v^(1/5)
(Brilliantov and others 1996, Phys. Rev. E 53:5382), yielding v^(-1/4) (Johnson 1985, Contact
Mechanics, 11.5), a fixed loss of energy (Thornton and Ning 1998, Powder Technol. 99:154), a film
1 - St_c/St (Davis, Serayssol, Hinch 1986, J. Fluid Mech. 163:479), an elastic plate (Zener 1941,
Phys. Rev. 59:669), contact adhesion ~ d and its work ~ d^(4/3) (Johnson, Kendall, Roberts 1971,
Proc. R. Soc. A 324:301).
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dem.constants import GRAVITY
from diagnosis.laws.readings import EXPONENT, Readings


@dataclass(frozen=True)
class FreeLaw:
    """One slot with one state in one experiment.

    coordinate: levers -> positive state (n,), None for a constant; weight: readings -> (n,) of an
    added term, None where the law multiplies; sign: of the added term, 0 for either; same: other
    (slot, state) that are the same function of the levers of this experiment; odds: log prior odds
    against a law that needs one cause alone.
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


HEIGHT, SIZE, RATE, STRESS = (
    "drop_height_mm", "particle_diameter_mm", "tilt_rate_deg_s", "normal_stress_kPa",
)  # fmt: skip


def _froude(levers):
    """Rate squared times diameter over gravity: the tilt while a grain falls by its own size."""
    return 1e-3 * levers[SIZE] * np.radians(levers[RATE]) ** 2 / GRAVITY


def _interval(levers):
    return np.nan_to_num(levers["output_interval_s"], nan=0.0)


def _frames(levers):
    """The interval of frames squared, over a height that comes back."""
    square = _interval(levers) ** 2
    return square / max(square.max(), 1e-30) * levers[HEIGHT].mean() / levers[HEIGHT]


WEIGHTS = {
    "over_height": lambda x: x[HEIGHT].mean() / x[HEIGHT],
    "over_stress": lambda x: x[STRESS].mean() / x[STRESS],
    "frames": _frames,
    "air": lambda x: x[HEIGHT] / x[SIZE] / (x[HEIGHT] / x[SIZE]).mean(),
    "root_of_froude": lambda x: np.cbrt(_froude(x) / _froude(x).mean()),
}
"""What the simplest kind of a law that adds acts by, about 1, of the levers."""

STATES = {
    # of a fall without air [m/s]
    "speed": ((HEIGHT,), lambda x: np.sqrt(2e-3 * GRAVITY * x[HEIGHT])),
    "size": ((SIZE,), lambda x: x[SIZE]),
    "interval": (("output_interval_s",), _interval),
    "rate": ((RATE,), lambda x: x[RATE]),
    "load": ((STRESS,), lambda x: x[STRESS]),
    "Froude number": ((RATE, SIZE), _froude),
    # the inertial number of a cell at one rate of shear goes with it (GDR MiDi 2004, Eur. Phys. J.
    # E 14:341)
    "size over root of load": ((SIZE, STRESS), lambda x: x[SIZE] / np.sqrt(x[STRESS])),
}
"""{state: (levers that it takes, what it is of them)}."""


def _law(experiment, slot, state=(), weight=(), needs=(), same=(), **rest):
    """`FreeLaw` of a row of laws.json."""
    known, state = [STATES[s] for s in state], tuple(state)
    needs = *(lever for levers, _ in known for lever in levers), *needs
    space = rest.pop("space", "linear" if weight else "log")
    coordinate = (lambda x: math.prod(of(x) for _, of in known)) if known else None
    others = tuple((s, tuple(of)) for s, of in same if (s, tuple(of)) != (slot, state))
    acts = (lambda r: math.prod(_weight(part, r) for part in weight)) if weight else None
    return FreeLaw(experiment, slot, state, needs, space, coordinate, acts, same=others, **rest)


def _weight(part, readings):
    """A function of WEIGHTS, or a power of a lever, 1 in the middle of the plan."""
    if isinstance(part, str):
        return WEIGHTS[part](readings.levers)
    [(lever, power)] = part.items()
    value = readings.levers[lever] ** float(power)
    return value / np.nanmean(value)


GIVEN = json.loads(Path(__file__).parents[1].joinpath("laws.json").read_text("utf-8"))
"""laws: by experiment the free laws that are tried, each a curve of the product of its states in a
slot. weight: of a law that adds a term, what its simplest kind acts by, all multiplied: of WEIGHTS,
or a lever with its power; sign: of the term, either unless given; needs: levers beside its states;
space: see `added`; same: places that are one function of the levers of this experiment, its own
among them or not. All that adds one stress to a shear test is one: a load or a mass on the lid that
was not counted, a wrong zero of the gauge, the friction of the ring on its own wall. odds: log
prior odds against a law that needs two causes at once: a pull, and a mass that is carried along.

forms: by slot, and experiment or last state, those of laws that add: the power of the state that
stands beside the weight; of a mass, the share of a middle grain's that each grain carries.

formulas: of forms that multiply (`FORMS`, and any step), with {c} (the coefficient in the middle of
the plan), {k}, {s} (the state) and {m} (its middle) to fill in; units: of states, others being
numbers."""

COEFFICIENT = {"drop": "restitution", "tilt": "friction", "shear": "friction"}
"""Slot of the coefficient of each experiment."""

FAMILY = tuple(_law(kind, **row) for kind, rows in GIVEN["laws"].items() for row in rows)
"""Every free law that can be tried."""


def applicable(readings: Readings) -> list[FreeLaw]:
    """The free laws whose levers vary in these readings, and one of each covariate."""
    kind, columns, vary = readings.experiment, readings.covariates, readings.folds.keys()
    found = [law for law in FAMILY if law.experiment == kind and vary >= set(law.needs)]
    found += [of_covariate(kind, name) for name in columns]
    return found + [with_size(kind, name) for name in columns if SIZE in vary]


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
        experiment, COEFFICIENT[experiment], (name, "size"), (name, SIZE), "log", lambda x: x[SIZE],
        lambda readings: share_of(readings.covariates[name]), odds=TOGETHER,
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


def natural(law: FreeLaw, readings: Readings, log: np.ndarray) -> np.ndarray:
    """The state of a law (k,) at logarithms of its coordinate (k,): a column that holds zero or
    less as it was recorded."""
    own = readings.columns.get(" x ".join(law.state), np.ones(1))
    if (own > 0.0).all():
        return np.exp(log)
    return own.mean() + 0.5 * np.ptp(own) * log


def scaled(law: FreeLaw, readings: Readings) -> tuple[np.ndarray, float, float]:
    """Coordinate (n,) of a law's state, its logarithm over the plan from -1 to 1, with middle and
    half range; all zero for a constant."""
    if law.coordinate is None:
        return np.zeros(len(readings.log)), 0.0, 0.0
    value = np.log(np.maximum(law.coordinate(readings.columns), 1e-12))
    low, high = value.min(), value.max()
    share = 2.0 * (value - low) / max(high - low, 1e-12) - 1.0
    return share, 0.5 * (low + high), 0.5 * (high - low)


def added(law: FreeLaw, term: np.ndarray, readings: Readings) -> np.ndarray:
    """Return what a term (k, n) adds to the logarithms of readings about their centre, by the space
    of its law: log, the term itself; linear, it is a share of the reading; angle, a share of the
    sliding angle."""
    if law.space == "log":
        return term
    if law.space == "linear":
        return np.log1p(term)
    angle = np.arctan(np.exp(readings.centre))
    return np.log(np.tan(np.clip(angle * (1.0 + term), 1e-6, 1.56))) - readings.centre


LADDER = np.geomspace(0.003, 1.2, 12)
"""Changes of the logarithm over half the range of the states that a form is tried at, in both
directions."""

BOTH = np.concatenate([-LADDER[::-1], LADDER])
LEAST = 0.02  # of a factor; below it a form has no meaning any more

ONSETS = np.geomspace(0.4, 2.5, 12)
THRESHOLD = "threshold, then -1/4"
FORMS: dict[str, Callable[..., Any]] = {
    "constant slope": lambda u, k: 1.0 + k * (u - 1.0),
    "power": lambda u, k: u**k,
    "exponential": lambda u, k: np.exp(k * (u - 1.0)),
    "logarithm": lambda u, k: 1.0 + k * np.log(u),
    "fifth root": lambda u, k: 1.0 + k * (u**0.2 - 1.0),
    "inverse": lambda u, k: 1.0 + k * (1.0 / u - 1.0),
    "fixed loss of energy": lambda u, k: np.sqrt(np.maximum(1.0 + k * (u**-2.0 - 1.0), 0.0)),
    "power 3/2": lambda u, k: 1.0 + k * (u**1.5 - 1.0),
    THRESHOLD: lambda u, k: np.minimum(1.0, (u / k) ** -0.25) / min(1.0, k**0.25),
}
"""Of laws that multiply: the factor of u and k on the coefficient."""


Forms = dict[str, tuple[np.ndarray, np.ndarray]]
"""{name: (strengths (k,), curves (k, n))}"""


def forms_of(law: FreeLaw, readings: Readings) -> Forms:
    """`Forms` of one free law: what each adds to the logarithms of readings about their centre."""
    if law.weight:
        return _added(law, readings)
    x, _, half = scaled(law, readings)
    u, out = np.exp(x * half), {}
    for name, factor in FORMS.items():
        if name == THRESHOLD and law.slot != "restitution":
            continue
        ks = ONSETS if name == THRESHOLD else _strengths(factor, u)
        with np.errstate(all="ignore"):
            factors = np.array([factor(u, k) for k in ks])
            curves = np.where(factors > LEAST, np.log(np.maximum(factors, LEAST)), np.nan)
        good = np.isfinite(curves).all(1)
        if good.any():
            out[name] = ks[good], EXPONENT[law.experiment] * curves[good]
    return out


STEP = "step at "
STEPS = 12  # places of a step that are tried, evenly among those that there are


def steps_of(law: FreeLaw, readings: Readings) -> Forms:
    """The same of a step of the coefficient between two levels of its one state; its strengths are
    the logarithms of what is above over what is below.

    Two levels at least are on each side: one alone is a level that was set wrongly."""
    if law.weight or len(law.state) != 1 or law.coordinate is None:
        return {}
    x, middle, half = scaled(law, readings)
    levels = np.unique(np.round(x, 9))
    places = 0.5 * (levels[1:-2] + levels[2:-1])
    if len(places) > STEPS:
        places = places[np.linspace(0, len(places) - 1, STEPS).round().astype(int)]
    at = natural(law, readings, middle + half * places)
    return {
        f"{STEP}{value:.4g}": (BOTH, EXPONENT[law.experiment] * BOTH[:, None] * (x > place))
        for value, place in zip(at, places, strict=True)
    }


def _strengths(factor, u):
    """Strengths (k,) at which a form changes by the steps of the ladder over half the range."""
    ends = np.array([u.min(), u.max()])
    step = 1e-4
    slope = np.ptp(factor(ends, step) - factor(ends, 0.0)) / step / 2.0
    return BOTH / slope


def factors_of(law: FreeLaw) -> dict[str, Callable[[np.ndarray], np.ndarray]]:
    """{name of a form: function of the logarithm of the state over the middle one, that stands
    beside the weight of the slot} of a law that adds. Each takes and gives (n,)."""
    if law.coordinate is None:
        return {"the same at all settings": _power(0.0)}
    own = GIVEN["forms"].get(law.slot, {})
    own = own.get(law.experiment) or own.get(law.state[-1]) or {"simplest": 0.0}
    return {name: (_carried if law.slot == "mass" else _power)(k) for name, k in own.items()}


def _power(power):
    return lambda t: np.exp(power * np.asarray(t))


def _carried(ratio):
    """Return what a mass that each grain carries leaves of a share of the weight, as a function of
    the logarithm of the size over the middle one; ratio: this mass over that of a middle grain."""
    return lambda t: (1.0 + ratio) / (1.0 + ratio * np.exp(-3.0 * t))


def _added(law, readings):
    x, _, half = scaled(law, readings)
    out = {}
    for name, factor in factors_of(law).items():
        term = law.weight(readings) * factor(x * half)
        ks = law.sign * LADDER if law.sign else BOTH
        # a reading is never negative
        ks = ks[(ks[:, None] * term > -0.95).all(1)]
        out[name] = ks, added(law, ks[:, None] * term, readings)
    return out
