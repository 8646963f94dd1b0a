"""Named forms of a free law, with one number each, and the test between them.

Forms that multiply are 1 at the middle of the plan's states (u = state over that), so that level
and shape do not trade against each other. Forms that add are the weight of their slot times a power
of u. Sources: a viscous contact 1 - e ~ v^(1/5) (Brilliantov and others 1996, Phys. Rev. E
53:5382), yielding v^(-1/4) (Johnson 1985, Contact Mechanics, 11.5), a fixed loss of energy
(Thornton and Ning 1998, Powder Technol. 99:154), a film 1 - St_c/St (Davis, Serayssol, Hinch 1986,
J. Fluid Mech. 163:479), an elastic plate (Zener 1941, Phys. Rev. 59:669), contact adhesion ~ d and
its work ~ d^(4/3) (Johnson, Kendall, Roberts 1971, Proc. R. Soc. A 324:301).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from diagnosis.laws.readings import IN_AIR, Readings
from diagnosis.laws.slots import FreeLaw, added, coordinates, natural, scaled

LADDER = np.geomspace(0.003, 1.2, 12)
"""Changes of the logarithm over half the range of the states that a form is tried at, in both
directions."""

LEAST = 0.02  # of a factor; below it a form has no meaning any more


@dataclass(frozen=True)
class Form:
    """factor(u, k) that multiplies the coefficient, and its text with {c} (the coefficient in the
    middle of the plan), {k}, {s} (the state) and {m} (its middle) to fill in."""

    name: str
    factor: object
    text: str


MULTIPLIES = (
    Form("constant slope", lambda u, k: 1.0 + k * (u - 1.0), "{c} (1 {k:+.3g} ({s}/{m} - 1))"),
    Form("power", lambda u, k: u**k, "{c} ({s}/{m})^{k:.3g}"),
    Form("exponential", lambda u, k: np.exp(k * (u - 1.0)), "{c} exp({k:.3g} ({s}/{m} - 1))"),
    Form("logarithm", lambda u, k: 1.0 + k * np.log(u), "{c} (1 {k:+.3g} ln({s}/{m}))"),
    Form("fifth root", lambda u, k: 1.0 + k * (u**0.2 - 1.0),
    "{c} (1 {k:+.3g} (({s}/{m})^0.2 - 1))"),
    Form("inverse", lambda u, k: 1.0 + k * (1.0 / u - 1.0), "{c} (1 {k:+.3g} ({m}/{s} - 1))"),
    Form(
        "fixed loss of energy",
        lambda u, k: np.sqrt(np.maximum(1.0 + k * (u**-2.0 - 1.0), 0.0)),
        "{c} sqrt(1 {k:+.3g} (({m}/{s})^2 - 1))",
    ),
    Form("power 3/2", lambda u, k: 1.0 + k * (u**1.5 - 1.0),
    "{c} (1 {k:+.3g} (({s}/{m})^1.5 - 1))"),
)  # fmt: skip
ONSETS = np.geomspace(0.4, 2.5, 12)
THRESHOLD = Form(
    "threshold, then -1/4",
    lambda u, k: np.minimum(1.0, (u / k) ** -0.25) / min(1.0, k**0.25),
    "{c} constant up to {k:.3g} x {m}, then falling as {s}^(-1/4)",
)


def _carried(ratio):
    """Return what a mass that each grain carries leaves of a share of the weight, as a function of
    the logarithm of the size over the middle one; ratio: this mass over that of a middle grain."""
    return lambda t: (1.0 + ratio) / (1.0 + ratio * np.exp(-3.0 * t))


OF_SIZE = {"in proportion to the size": 1.0, "inversely to the size": -1.0}
ADDS = {
    ("attraction", "drop"): {"work ~ d^2": 0.0, "work ~ d^(4/3)": -2 / 3, "work ~ d": -1.0},
    ("attraction", "tilt"): {"force ~ d^2": 0.0, "force ~ d": -1.0,
    "force alike for all sizes": -2.0},
    ("mass", "tilt"): {f"force ~ d, with a mass of {r:g} middle grains": _carried(r)
    for r in (0.3, 1.0, 3.0)},
    ("attraction", "shear"): {"stress ~ 1/d": 0.0, "stress ~ 1/d^2": -1.0},
    ("reading", "size"): {"a share of the diameter": 0.0, "diameter squared": 1.0,
    "root of the diameter": -0.5},
    ("reading", "interval"): {"square of the interval": 0.0, "the interval": -1.0},
    ("reading", "Froude number"): {"slip of a share of the diameter": 0.0},
    ("reading", "rate"): {"rate^(2/3)": 0.0, "a fixed delay": 1 / 3, "rate^2": 4 / 3},
    ("restitution", "size"): OF_SIZE,
    ("friction", "size"): OF_SIZE,
    ("drag", "size"): {"C_D constant": 0.0, "C_D ~ Re^(-1/2)": -0.5, "C_D ~ 1/Re": -1.0},
}  # fmt: skip
"""(slot, experiment or last state) -> what stands beside the weight of the slot: a power of the
state, or a function of its logarithm."""


def forms_of(
    law: FreeLaw, readings: Readings, centre: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """{name: (strengths (k,), curves (k, n))} of the named forms of one free law: what each adds to
    the logarithms of readings about `centre` (n,)."""
    return _added(law, readings, centre) if law.weight else _multiplied(law, readings)


def forms_at(law: FreeLaw, u: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """{name: (strengths (k,), curves (k, m))} of the forms of a law that multiplies, at states u
    (m,) over that in the middle: logarithms of the reading."""
    power = IN_AIR if law.experiment == "drop" else 1.0
    out = {}
    for form in (*MULTIPLIES, THRESHOLD) if law.slot == "restitution" else MULTIPLIES:
        ks = ONSETS if form is THRESHOLD else _strengths(form, u)
        curves = np.array([_logarithm(form, u, k) for k in ks])
        good = np.isfinite(curves).all(1)
        if good.any():
            out[form.name] = ks[good], power * curves[good]
    return out


STEP = "step at "
STEPS = 12  # places of a step that are tried, evenly among those that there are


def steps_of(law: FreeLaw, readings: Readings) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The same of a step of the coefficient between two levels of its one state; its strengths are
    the logarithms of what is above over what is below.

    Two levels at least are on each side: one alone is a level that was set wrongly."""
    levers = coordinates(readings)
    if law.weight or len(law.state) != 1 or law.coordinate is None:
        return {}
    x, middle, half = scaled(law, levers)
    levels = np.unique(np.round(x, 9))
    places = 0.5 * (levels[1:-2] + levels[2:-1])
    if len(places) > STEPS:
        places = places[np.linspace(0, len(places) - 1, STEPS).round().astype(int)]
    ks = np.concatenate([-LADDER[::-1], LADDER])
    power = IN_AIR if law.experiment == "drop" else 1.0
    at = natural(law, levers, middle + half * places)
    return {
        f"{STEP}{value:.4g}": (ks, power * ks[:, None] * (x > place))
        for value, place in zip(at, places, strict=True)
    }


def _multiplied(law, readings):
    x, _, half = scaled(law, coordinates(readings))
    return forms_at(law, np.exp(x * half))


def _logarithm(form, u, k):
    with np.errstate(all="ignore"):
        factor = form.factor(u, k)
        return np.where(factor > LEAST, np.log(np.maximum(factor, LEAST)), np.nan)


def _strengths(form, u):
    """Strengths (k,) at which the form changes by the steps of the ladder over half the range."""
    ends = np.array([u.min(), u.max()])
    step = 1e-4
    slope = np.ptp(form.factor(ends, step) - form.factor(ends, 0.0)) / step / 2.0
    return np.concatenate([-LADDER[::-1], LADDER]) / slope


def factors_of(law: FreeLaw) -> dict[str, Callable[[np.ndarray], np.ndarray]]:
    """{name of a form: function of the logarithm of the state over the middle one, that stands
    beside the weight of the slot} of a law that adds. Each takes and gives (n,)."""
    if law.coordinate is None:
        return {"the same at all settings": _power(0.0)}
    last = law.state[-1] if law.state else ""
    own = ADDS.get((law.slot, law.experiment)) or ADDS.get((law.slot, last)) or {"simplest": 0.0}
    return {name: p if callable(p) else _power(p) for name, p in own.items()}


def _power(power):
    return lambda t: np.exp(power * np.asarray(t))


def _added(law, readings, centre):
    levers = coordinates(readings)
    weight = law.weight(levers, centre)
    x, _, half = scaled(law, levers) if law.coordinate else (np.zeros(len(centre)), 0, 0)
    out = {}
    for name, factor in factors_of(law).items():
        term = weight * factor(x * half)
        ks = law.sign * LADDER if law.sign else np.concatenate([-LADDER[::-1], LADDER])
        # a reading is never negative
        ks = ks[(ks[:, None] * term > -0.95).all(1)]
        out[name] = ks, added(law.space, ks[:, None] * term, centre)
    return out


def text_of(name: str) -> str:
    """Formula of a form of a law that multiplies, to be filled in (see `Form`)."""
    if name.startswith(STEP):
        return "{c} below, and exp({k:.3g}) times that above"
    [text] = [f.text for f in (*MULTIPLIES, THRESHOLD) if f.name == name]
    return text
