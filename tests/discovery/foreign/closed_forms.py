"""Laws of nature and of laboratories in closed form: what a measurement would read, knowing nothing
of this project.

A law gives the true rebound [mm] of a drop or the true sliding angle [deg] from the levers, with
one strength that is 0 where it does nothing. `table` scales the strength until the largest distance
of a setting from the best constant (restitution, friction) is so many standard errors, adds noise,
and writes rows of the measurements' format.

Each law says in `right` which (slot, state) name it. Where two are the same function of the levers
for every plan, both are right: a rebound e^2 (H - c) is a sticking speed as well as a reading that
is off by a length; the load of a grain on a plate is a function of its size alone.
"""

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.optimize import brentq

G = 9.81
DENSITY, AIR = 1210.0, 1.2  # kg/m3
LEVERS = (
    "drop_height_mm",
    "particle_diameter_mm",
    "output_interval_s",
    "tilt_rate_deg_s",
)
COLUMNS = (
    "experiment",
    "quantity",
    "value",
    "unit",
    "sd",
    "n",
    *LEVERS,
    "batch",
    "instrument",
    "note",
)


def speed(h_mm):
    """Impact speed [m/s] after a fall of h [mm] without air."""
    return np.sqrt(2e-3 * G * h_mm)


@dataclass(frozen=True)
class Law:
    """value(levers, strength) -> true reading (n,); levers are arrays (n,). curve(levers,
    strength): what the law says of its own slot (restitution, friction), None where it says another
    thing."""

    name: str
    experiment: str
    right: tuple
    value: Callable
    curve: Callable | None = None
    names: tuple = ()  # catalogue entries that would be right
    least: float = 1e-9
    most: float = 1.0


def _restitution(name, right, factor, e0=0.72, most=1.0, names=()):
    def curve(x, k):
        return np.clip(e0 * factor(x, k), 1e-3, 1.0)

    def value(x, k):
        return curve(x, k) ** 2 * x["drop_height_mm"]

    return Law(name, "drop", right, value, curve, names, most=most)


def _friction(name, right, factor, mu=0.55, most=1.0, names=()):
    def curve(x, k):
        return mu * factor(x, k)

    def value(x, k):
        return np.degrees(np.arctan(curve(x, k)))

    return Law(name, "tilt", right, value, curve, names, most=most)


def _v(x):
    return speed(x["drop_height_mm"])


def _d(x):
    return x["particle_diameter_mm"]


SPEED, SIZE = ("restitution", ("speed",)), ("restitution", ("size",))
STOKES = ("restitution", ("speed", "size"))
LENGTH = ("reading", ())
BY_SIZE = (("friction", ("size",)), ("friction", ("load",)))
BY_RATE = (("friction", ("rate",)), ("reading", ("rate",)))


def _yielding(x, k):
    """Constant up to a speed, falling as v^(-1/4) above it (Johnson 1985, Contact Mechanics,
    11.5)."""
    onset = 3.0 * math.exp(-4.0 * k)
    return np.minimum(1.0, (_v(x) / onset) ** -0.25)


def _sticking(x, k):
    """e0 sqrt(1 - (v_s/v)^2): each impact pays a fixed energy (Thornton and Ning 1998, Powder
    Technol. 99:154)."""
    return np.sqrt(np.clip(1.0 - (k / _v(x)) ** 2, 1e-4, 1.0))


def _in_air(x, k):
    """Fall and rise against Newton's drag of C_D = 0.44, air k times as dense; restitution
    constant."""
    e, d, h = 0.72, 1e-3 * _d(x), 1e-3 * x["drop_height_mm"]
    terminal = 4.0 * DENSITY * d * G / (3.0 * 0.44 * AIR * max(k, 1e-9))  # squared
    impact = terminal * -np.expm1(-2.0 * G * h / terminal)
    return 1e3 * terminal / (2.0 * G) * np.log1p(e**2 * impact / terminal)


def _wet_drop(x, k):
    """A pull ~ d^2 over a fixed range costs energy ~ d^2 of a mass ~ d^3: a height ~ 1/d is
    lost."""
    return np.maximum(0.72**2 * x["drop_height_mm"] - k * 20.0 / _d(x), 1e-2)


LAWS = (
    _restitution("linear in speed", (SPEED,), lambda x, k: 1.0 - k * _v(x), most=0.3),
    _restitution("power of speed", (SPEED,), lambda x, k: _v(x) ** -k),
    _restitution("exponential in speed", (SPEED,), lambda x, k: np.exp(-k * _v(x))),
    _restitution("fifth root of speed", (SPEED,), lambda x, k: 1.0 - k * _v(x) ** 0.2, 0.95,
                 0.8, ("viscoelastic_restitution",)),
    _restitution("yielding", (SPEED,), _yielding, most=1.5, names=("plastic_restitution",)),
    _restitution("sticking speed", (SPEED, LENGTH), _sticking, most=0.8),
    _restitution("plate swallows the larger ball", (SIZE,),
                 lambda x, k: 1.0 - k * (_d(x) / 4.0) ** 1.5, most=0.6),
    _restitution("power of size", (SIZE,), lambda x, k: (_d(x) / 2.0) ** k, 0.6),
    _restitution("lubrication film", (STOKES,), lambda x, k: 1.0 - k / (_v(x) * _d(x)), 0.85, 2.0),
    Law("reading off by a radius", "drop", (("reading", ("size",)),),
        lambda x, k: 0.72**2 * x["drop_height_mm"] + k * _d(x), most=5.0),
    Law("release height off", "drop", (LENGTH, SPEED),
        lambda x, k: 0.72**2 * (x["drop_height_mm"] + 20.0 * k)),
    Law("drag of air", "drop", (("drag", ("speed", "size")),), _in_air, None, ("air_drag",),
        most=30.0),
    Law("attraction as d^2, drops", "drop", (("attraction", ("size",)),), _wet_drop, None,
        ("wall_adhesion", "liquid_bridge")),
    Law("apex between frames", "drop", (("reading", ("interval",)),),
        lambda x, k: np.maximum(
            0.72**2 * x["drop_height_mm"] - 1e3 * G * k * x["output_interval_s"] ** 2, 1e-2),
        None, ("apex_sampling",)),
    _friction("logarithm of the rate", BY_RATE, lambda x,
    k: 1.0 + k * np.log(x["tilt_rate_deg_s"])),
    _friction("power of the load", BY_SIZE, lambda x, k: (_d(x) / 2.0) ** (-3.0 * k),
              names=("stress_dependent_friction",)),
    _friction("rises with size", BY_SIZE, lambda x, k: 1.0 + k * _d(x)),
    _friction("attraction as d^2, slides", (("attraction", ("size",)), *BY_SIZE),
              lambda x, k: 1.0 + k / _d(x), names=("wall_adhesion",)),
    _friction("saturates with size", BY_SIZE, lambda x, k: 1.0 + k * np.exp(-_d(x) / 1.5)),
    Law("late hand", "tilt", BY_RATE,
        lambda x, k: np.degrees(np.arctan(0.55)) + k * x["tilt_rate_deg_s"],
        None, ("tilt_detection_lag",)),
)  # fmt: skip

DROP_PLANS = (
    [(h, d, None) for h in (50, 80, 120, 180, 250) for d in (1.5, 2.0, 3.0, 4.0)],
    [(h, d, None) for h in (40, 75, 130, 230, 400, 600) for d in (1.0, 1.6, 2.5, 3.6)],
    [(h, d, t) for h in (60, 110, 190, 320) for d in (1.2, 1.7, 2.4, 3.2, 4.0) for t in (None,)],
)
FILM_PLAN = [
    (h, d, t) for h in (60, 120, 240) for d in (2.0, 4.0) for t in (0.005, 0.01, 0.02, 0.033)
]
TILT_PLANS = (
    [(w, d) for w in (2, 4, 8, 14, 20) for d in (1.0, 1.5, 2.2, 3.2)],
    [(w, d) for w in (3, 6, 12, 20) for d in (1.0, 1.4, 2.0, 2.8, 4.0)],
)
RELATIVE, DEGREES, REPLICATES = 0.02, 0.4, 5
"""Noise of one reading of a rebound (a share) and of an angle; readings of a setting."""


def plan(experiment, which, film=False):
    """{lever: (n,)} of a plan; nan where a lever is not set."""
    if experiment == "tilt":
        rows = np.array(TILT_PLANS[which % len(TILT_PLANS)], float)
        return dict(zip(("tilt_rate_deg_s", "particle_diameter_mm"), rows.T, strict=True))
    rows = FILM_PLAN if film else DROP_PLANS[which % len(DROP_PLANS)]
    h, d, t = np.array([[np.nan if v is None else v for v in r] for r in rows], float).T
    return {"drop_height_mm": h, "particle_diameter_mm": d, "output_interval_s": t}


def standard_error(experiment, value):
    """Of a setting's mean."""
    return (RELATIVE * value if experiment == "drop" else DEGREES + 0.0 * value) / math.sqrt(
        REPLICATES
    )


def distance(law, x, k):
    """Largest distance of a setting from the best constant, in standard errors."""
    true = law.value(x, k)
    error = standard_error(law.experiment, true)
    shape = x["drop_height_mm"] if law.experiment == "drop" else np.ones(len(true))
    best = (shape * true / error**2).sum() / (shape**2 / error**2).sum()
    return float(np.abs((true - best * shape) / error).max())


def strength(law, x, size):
    """The strength at which the law is `size` standard errors large; its largest where it is never
    so large."""
    ladder = np.geomspace(1e-6, 1.0, 60) * law.most
    reach = np.array([distance(law, x, k) for k in ladder])
    if reach.max() < size:
        return float(ladder[np.argmax(reach)])
    k = int(np.argmax(reach >= size))
    if k == 0:
        return float(ladder[0])
    return brentq(lambda s: distance(law, x, s) - size, ladder[k - 1], ladder[k])


@dataclass
class Set:
    """A data set, its law (None for a null) and what is true of it."""

    table: pd.DataFrame
    law: Law | None
    strength: float
    levers: dict


def draw(law, size, seed, which=0):
    """`Set` of a law at so many standard errors."""
    rng = np.random.default_rng([seed, zlib.crc32(law.name.encode())])
    x = plan(law.experiment, which, ("reading", ("interval",)) in law.right)
    k = strength(law, x, size)
    return Set(_read(law.experiment, x, law.value(x, k), rng), law, k, x)


def _read(experiment, x, true, rng, note=""):
    """The table of means and spreads of replicates around the true readings."""
    n = len(true)
    noise = RELATIVE * true[:, None] if experiment == "drop" else DEGREES
    readings = true[:, None] + noise * rng.standard_normal((n, REPLICATES))
    unit, quantity = ("mm", "rebound_height") if experiment == "drop" else ("deg", "sliding_angle")
    rows = {
        "experiment": experiment,
        "quantity": quantity,
        "value": readings.mean(1),
        "unit": unit,
        "sd": readings.std(1, ddof=1),
        "n": REPLICATES,
        **{k: v for k, v in x.items() if not np.isnan(v).all()},
        "note": note,
    }
    table = pd.DataFrame(rows)
    return table[[c for c in COLUMNS if c in table]]


NULLS = (
    "plain",
    "camera set up anew for each height",
    "another lot for each size",
    "error between settings",
    "declared batches",
    "two instruments",
    "one doubled reading",
    "plain slides",
    "plate cleaned for each rate",
)
SHARED = (
    "camera set up anew for each height",
    "another lot for each size",
    "declared batches",
    "two instruments",
    "plate cleaned for each rate",
)
"""Nulls in which readings of a level, a batch or an instrument share an error."""


def null(kind, seed, which=0):
    """`Set` without a law: constant restitution or friction, with an error that laboratories have.

    Errors between settings have 2 standard errors of a setting, an instrument is off by 3.
    """
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode())])
    experiment = "tilt" if kind in ("plain slides", "plate cleaned for each rate") else "drop"
    x = plan(experiment, which)
    n = len(next(iter(x.values())))
    e = rng.uniform(0.45, 0.85)
    true = e**2 * x["drop_height_mm"] if experiment == "drop" else np.full(n, 100.0 * e / 2.0)
    scale = 2.0 * standard_error(experiment, true)
    extra = {}
    if kind in (
        "camera set up anew for each height",
        "another lot for each size",
        "plate cleaned for each rate",
    ):
        lever = {"c": "drop_height_mm", "a": "particle_diameter_mm", "p": "tilt_rate_deg_s"}[
            kind[0]
        ]
        level = np.unique(x[lever], return_inverse=True)[1]
        true = true + scale * rng.standard_normal(level.max() + 1)[level]
    elif kind == "error between settings":
        true = true + scale * rng.standard_normal(n)
    elif kind == "declared batches":
        batch = rng.permutation(np.arange(n) % 4)
        true, extra = true + scale * rng.standard_normal(4)[batch], {"batch": batch + 1}
    elif kind == "two instruments":
        tool = rng.permutation(np.arange(n) % 2)
        true, extra = true + 1.5 * scale * tool, {"instrument": np.where(tool, "video", "sound")}
    table = _read(experiment, x, true, rng)
    for name, value in extra.items():
        table[name] = value
    if kind == "one doubled reading":
        row = int(rng.integers(n))
        table.loc[row, "value"] *= rng.choice([0.7, 1.3])
        table["note"] = np.where(np.arange(n) == row, "mistyped", "")
    return Set(table[[c for c in COLUMNS if c in table]], None, 0.0, x)
